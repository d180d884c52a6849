"""Bounded message queue of one page. A slow page receives the latest messages."""

from __future__ import annotations

import asyncio

TEXT_KEPT = 256 << 10  # characters of the terminal in the queue of one page
MOST_KEPT = 2000  # maximum number of messages in the queue


class Outbox:
    """Messages for one page, for use only in the server's thread."""

    def __init__(self) -> None:
        self.filled = asyncio.Event()
        self._waiting: dict[str, str] = {}
        self._number = 0
        self._text = 0

    def put(self, key: str, message: str) -> None:
        """Add a message. It replaces a message with the same ``key``, unless the key is "" or "text"."""
        if key and key != "text":
            self._waiting.pop(key, None)
        else:
            self._number += 1
            if key == "text":
                self._text += len(message)
            key = f"{key}#{self._number}"
        self._waiting[key] = message
        while self._text > TEXT_KEPT:
            self._drop("text#")
        if len(self._waiting) > MOST_KEPT:
            self._drop("")
        self.filled.set()

    def take(self) -> str | None:
        for key in self._waiting:
            return self._remove(key)
        self.filled.clear()
        return None

    def _drop(self, begin: str) -> None:
        self._remove(next(key for key in self._waiting if key.startswith(begin) and "#" in key))

    def _remove(self, key: str) -> str:
        message = self._waiting.pop(key)
        if key.startswith("text#"):
            self._text -= len(message)
        return message
