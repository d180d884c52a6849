"""A program in a pseudo-terminal, to which a test types."""

from __future__ import annotations

import os
import select
import subprocess
import time
from collections.abc import Mapping, Sequence
from typing import Self

DEADLINE_S = 60.0


class Terminal:
    """A running program, until the ``with`` block ends."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        self._ours, its = os.openpty()
        self._shown = ""
        self._process = subprocess.Popen(
            command, env=environment, stdin=its, stdout=its, stderr=its, start_new_session=True
        )
        os.close(its)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._ours)

    def type(self, text: str) -> None:
        os.write(self._ours, text.encode())

    def read_until(self, text: str) -> None:
        """Wait until the program shows a text after the text of the previous call."""
        deadline_s = time.monotonic() + DEADLINE_S
        while text not in self._shown:
            left_s = deadline_s - time.monotonic()
            assert left_s > 0, self._shown
            if select.select([self._ours], [], [], left_s)[0]:
                self._shown += os.read(self._ours, 1 << 16).decode("utf-8", "replace")
        self._shown = self._shown.partition(text)[2]
