"""The server of ``fcu mcp`` as a process: its streams, its end, its guides, and its absence without the SDK."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from mcp import Client

from fcu_emulator.emulator.agents import server as agent_server
from fcu_emulator.emulator.agents.guides import guide_text, guides
from fcu_emulator.emulator.agents.server import LONGEST_MESSAGE, SCHEME, AgentServer, lines_of_stream
from fcu_emulator.emulator.agents.texts import MOST_BYTES, MOST_LINES
from fcu_emulator.emulator.agents.tools import LARGEST_RESULT, TOOLS
from fcu_emulator.emulator.errors import InputError
from tests.integration.test_docs import text_of
from tests.support.agent_client import ROOT, connected, environment, server_command

INTERRUPTED, USAGE_ERROR = 130, 2
CLIENT = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "test", "version": "1"}}
PAGES = sorted(path.name for path in (ROOT / "docs").glob("*.md"))
posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM for other processes")


class RawClient:
    """A client that writes and reads single lines."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process
        self._count = 0

    def write(self, data: bytes) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(data + b"\n")
        self.process.stdin.flush()

    def send(self, method: str, **params: Any) -> int:
        """Send a request, and return its id."""
        self._count += 1
        message = {"jsonrpc": "2.0", "id": self._count, "method": method, "params": params}
        self.write(json.dumps(message).encode())
        return self._count

    def read(self) -> dict[str, Any]:
        """Return the next line of standard output, which must be a message of the protocol."""
        assert self.process.stdout is not None
        message = json.loads(self.process.stdout.readline())
        assert message["jsonrpc"] == "2.0"
        return dict(message)

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        number = self.send(method, **params)
        while (answer := self.read()).get("id") != number:
            pass
        return dict(answer["result"])

    def tool(self, name: str, **arguments: Any) -> dict[str, Any]:
        return self.ask("tools/call", name=name, arguments=arguments)

    def end(self) -> int:
        """Close standard input, and return the exit code."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        return self.process.wait(60)


@contextmanager
def server(folder: Path, command: Sequence[str] = ()) -> Iterator[RawClient]:
    process = subprocess.Popen(
        command or server_command(),
        cwd=folder,
        env={**environment(), "TMPDIR": str(folder)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    client = RawClient(process)
    try:
        client.ask("initialize", **CLIENT)
        client.write(b'{"jsonrpc": "2.0", "method": "notifications/initialized"}')
        yield client
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            assert stream is not None
            with suppress(OSError):  # a pipe without a reader
                stream.close()


def test_standard_output_has_only_messages(tmp_path: Path) -> None:
    with server(tmp_path) as client:
        ran = client.tool("run", firmware="lab3", duration="1500ms")
        client.tool("start_board", firmware="solution")
        client.tool("run_board", seconds=1.5)
        client.tool("build", folder="nowhere")
        code = client.end()
        assert client.process.stdout is not None
        rest = client.process.stdout.read()

    assert "LAB3 Init..." in ran["structuredContent"]["terminal"]["text"]
    assert (code, rest) == (0, b"")


@pytest.mark.skipif(sys.platform == "win32", reason="the event loop of Windows connects to itself by a port")
def test_server_opens_no_port(tmp_path: Path) -> None:
    watched = (
        "import sys; sys.addaudithook(lambda event, data: event == 'socket.bind' and open('bound', 'w').close()); "
        "import socket; {}; from fcu_emulator.emulator.cli import execute; sys.exit(int(execute(['mcp'])))"
    )
    for before, bound in (("pass", False), ("socket.create_server(('127.0.0.1', 0)).close()", True)):
        with server(tmp_path, [sys.executable, "-c", watched.format(before)]) as client:
            client.tool("start_board", firmware="solution")
            client.tool("run_board", seconds=0.1)
            client.ask("resources/list")
            assert client.end() == 0
        assert (tmp_path / "bound").exists() == bound


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"no JSON",
        b"[" * 10_000,
        b"\xff\xfe",
        b'{"jsonrpc": "2.0"}',
        b'"' + b"x" * (2 * LONGEST_MESSAGE) + b'"',
    ],
    ids=["empty", "text", "deep", "bytes", "no method", "long"],
)
def test_server_survives_line_that_is_not_message(line: bytes, tmp_path: Path) -> None:
    with server(tmp_path) as client:
        client.write(line)

        assert len(client.ask("tools/list")["tools"]) > 10
        assert client.end() == 0


def test_lines_of_stream_are_bounded() -> None:
    parts = [b"on", b"e\ntwo\n", b"x" * LONGEST_MESSAGE, b"y" * LONGEST_MESSAGE, b"z\nthree\nunfinished", b""]

    assert list(lines_of_stream(iter(parts).__next__)) == [
        "one",
        "two",
        "a message that is too long",
        "three",
    ]


@pytest.mark.parametrize("size", [LONGEST_MESSAGE - 1, LONGEST_MESSAGE, LONGEST_MESSAGE + 1])
def test_longest_message_is_read(size: int) -> None:
    (line,) = lines_of_stream(iter([b"x" * size + b"\n", b""]).__next__)

    assert len(line) == (size if size <= LONGEST_MESSAGE else 26)


def started(client: RawClient, folder: Path) -> None:
    """Start a run that takes minutes, and wait until its process has a folder."""
    client.send("tools/call", name="run", arguments={"firmware": "solution", "duration": "100000s"})
    while not list(folder.glob("fcu-agents-*")):
        client.ask("ping")


@posix
@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
def test_signal_ends_server_and_its_run(name: str, tmp_path: Path, interruptible: None) -> None:
    with server(tmp_path) as client:
        started(client, tmp_path)
        client.process.send_signal(signal.Signals[name])
        code = client.process.wait(60)

    assert code == INTERRUPTED
    assert list(tmp_path.glob("fcu-agents-*")) == []


def test_end_of_client_ends_server_and_its_run(tmp_path: Path) -> None:
    with server(tmp_path) as client:
        started(client, tmp_path)
        client.send("tools/call", name="start_board", arguments={"firmware": "solution"})
        client.send("tools/call", name="run_board", arguments={"seconds": 3600})

        assert client.end() == 0
    assert list(tmp_path.glob("fcu-agents-*")) == []


def test_cancelled_call_ends_soon(tmp_path: Path) -> None:
    with server(tmp_path) as client:
        started(client, tmp_path)
        cancel = {"jsonrpc": "2.0", "method": "notifications/cancelled", "params": {"requestId": 2}}
        client.write(json.dumps(cancel).encode())
        after = client.tool("run", firmware="lab3", duration="100ms")  # waits for the end of the other run

        assert after["structuredContent"]["virtual_s"] == 0.1
        assert client.end() == 0


def test_long_call_reports_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clients give up after some time without progress. The server is in this process."""
    monkeypatch.setattr(agent_server, "PROGRESS_EVERY_S", 0.05)
    reported: list[tuple[float, str | None]] = []

    async def note(progress: float, total: float | None, message: str | None) -> None:
        reported.append((progress, message))

    async def session() -> Any:
        async with Client(AgentServer("1")._server) as client:
            return await client.call_tool(
                "run", {"firmware": "lab3", "duration": "1s"}, progress_callback=note
            )

    assert not asyncio.run(session()).is_error
    times = [progress for progress, _ in reported]
    assert len(times) > 2
    assert times == sorted(set(times))
    assert reported[0][1] == "run: 0 s"


def test_server_without_sdk_is_refused(tmp_path: Path) -> None:
    script = (
        "import sys; sys.modules['mcp'] = None; from fcu_emulator.emulator.cli import execute; "
        "sys.exit(int(execute(['mcp'])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )

    assert (done.returncode, done.stdout) == (USAGE_ERROR, "")
    assert done.stderr.count("\n") == 1
    assert 'pip install "fcu-emulator[mcp]"' in done.stderr


# -- Guides -------------------------------------------------------------------------------------------------


def test_list_of_guides_has_every_page() -> None:
    names = [one.name for one in guides()]

    assert sorted(names) == PAGES
    assert len(set(names)) == len(names)


def test_titles_in_list_are_titles_of_pages() -> None:
    titles = {one.name: text_of(ROOT / "docs" / one.name).partition("\n")[0] for one in guides()}

    assert {one.name: f"# {one.title}" for one in guides()} == titles


def test_list_of_guides_has_specified_form() -> None:
    """See https://llmstxt.org: a title, a summary as a quotation, sections with lists of links."""
    first, empty, summary, *rest = guide_text("llms.txt").splitlines()
    links = [line for line in rest if line.startswith("- ")]

    assert first == "# fcu-emulator"
    assert empty == ""
    assert summary.startswith("> ")
    assert all(re.fullmatch(r"- \[[^\]]+\]\(docs/[\w-]+\.md\): .+", line) for line in links)
    assert len(links) == len(PAGES)
    assert len([line for line in rest if line.startswith("## ")]) >= 3


@pytest.mark.parametrize(
    "name", ["../pyproject.toml", "conf.py", "", "/etc/passwd", "STUDENT.md", "student.md/../conf.py"]
)
def test_only_listed_files_are_guides(name: str) -> None:
    with pytest.raises(InputError, match=r"llms\.txt lists the guides"):
        guide_text(name)


def test_guides_are_resources(tmp_path: Path) -> None:
    with connected(tmp_path) as client:
        listed = {one.uri: one for one in client.ask("list_resources").resources}
        assert set(listed) == {f"{SCHEME}{name}" for name in ("llms.txt", *PAGES)}
        for name in ("docs/student.md", "llms.txt"):
            uri = SCHEME + name.removeprefix("docs/")
            (content,) = client.ask("read_resource", uri).contents
            assert content.text == text_of(ROOT / name)
            assert content.mime_type == listed[uri].mime_type
        for uri in ("fcu://docs/../pyproject.toml", "fcu://docs/%2e%2e/pyproject.toml", "file:///etc/passwd"):
            with pytest.raises(Exception, match="guide"):
                client.ask("read_resource", uri)

        page = client.call("read_text", name="student.md")
        assert page["text"].startswith("# The lab, exercise by exercise")
        assert page["rest"] == 'read_text(name="student.md", first_line=201)'


# -- The page -----------------------------------------------------------------------------------------------

PAGE = text_of(ROOT / "docs" / "agents.md")
JSON = re.findall(r"^ *```json\n(.*?)```$", PAGE, re.DOTALL | re.MULTILINE)
TOML = re.findall(r"^ *```text\n(.*?)```$", PAGE, re.DOTALL | re.MULTILINE)


def test_client_configurations_on_page_start_server() -> None:
    """The keys are those of each client's documentation."""
    first, second = map(json.loads, JSON)
    (third,) = map(tomllib.loads, TOML)
    started_by = {"command": "fcu", "args": ["mcp"]}

    assert first == {"mcpServers": {"fcu": started_by}}
    assert second == {"servers": {"fcu": {"type": "stdio", **started_by}}}
    assert third == {"mcp_servers": {"fcu": started_by}}
    assert PAGE.count(" mcp add fcu -- fcu mcp`") == 2


def test_tools_on_page_are_tools_of_server() -> None:
    table = PAGE.partition("| tool | arguments | effect |")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \|", table, re.MULTILINE)
    arguments = {name: set(re.findall(r"`(\w+)`", cell)) for name, cell in rows}

    assert arguments == {name: set(tool.schema()["properties"]) for name, tool in TOOLS.items()}
    assert [name for name, _ in rows] == list(TOOLS)


def test_limits_on_page_are_limits_of_server() -> None:
    table = PAGE.partition("## Limits")[2]
    limits = (MOST_LINES, MOST_BYTES, LARGEST_RESULT, TOOLS["check"].wall_s, TOOLS["run"].wall_s)

    assert [f"{limit:,g}" in table for limit in limits] == [True] * 5
    assert TOOLS["build"].wall_s == TOOLS["check"].wall_s
    assert {one.wall_s for one in TOOLS.values() if one.on_board} == {TOOLS["run"].wall_s}
    assert LONGEST_MESSAGE == 1 << 20
