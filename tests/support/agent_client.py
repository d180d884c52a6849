"""A client of ``fcu mcp``: the protocol's own client over stdio, with calls that wait for their result."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from anyio.from_thread import BlockingPortal, start_blocking_portal
from mcp import Client
from mcp.client.stdio import StdioServerParameters, stdio_client

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Answer:
    """The result of a tool, or its error: one of ``data`` and ``error`` is empty."""

    data: dict[str, Any]
    error: str


class AgentClient:
    """A connected client."""

    def __init__(self, portal: BlockingPortal, client: Client) -> None:
        self._portal = portal
        self.client = client

    def ask(self, method: str, *arguments: Any) -> Any:
        """Call a method of the SDK's client."""
        return self._portal.call(getattr(self.client, method), *arguments)

    def answer(self, tool: str, **arguments: Any) -> Answer:
        result = self.ask("call_tool", tool, arguments)
        (content,) = result.content
        if result.is_error:
            return Answer({}, content.text)
        assert json.loads(content.text) == result.structured_content
        return Answer(result.structured_content, "")

    def call(self, tool: str, **arguments: Any) -> dict[str, Any]:
        """Return the result of a tool, which must not be an error."""
        answer = self.answer(tool, **arguments)
        assert answer.error == ""
        return answer.data

    def error(self, tool: str, **arguments: Any) -> str:
        """Return the error of a tool, which must be one short line."""
        answer = self.answer(tool, **arguments)
        assert answer.error, answer.data
        assert len(answer.error.splitlines()) == 1
        assert len(answer.error) <= 1000
        return answer.error


def server_command() -> list[str]:
    return [sys.executable, "-m", "fcu_emulator", "mcp"]


def environment() -> dict[str, str]:
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    return {**os.environ, "PYTHONPATH": path}


@contextmanager
def connected(folder: Path, mode: str = "auto") -> Iterator[AgentClient]:
    """Start a server in ``folder``, and connect to it."""
    command, *arguments = server_command()
    server = StdioServerParameters(command=command, args=arguments, env=environment(), cwd=folder)
    with start_blocking_portal() as portal:
        client = Client(stdio_client(server), mode=mode)
        with portal.wrap_async_context_manager(client):
            yield AgentClient(portal, client)
