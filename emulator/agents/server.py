"""The server: the Model Context Protocol on standard input and output.

Decision: the protocol's own SDK is used, in its low-level form. Its high-level form prefixes each error, and shows wrong
arguments in several lines. The SDK answers clients of all versions of the protocol.

Decision: a separate thread reads standard input. The SDK's reader cannot be cancelled, so that Ctrl-C would have no
effect before the next message.
"""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, Final, TypeVar, cast

import anyio
import mcp_types as types
from mcp.server import Server, ServerRequestContext
from mcp.server.stdio import stdio_server
from mcp.shared.exceptions import MCPError

from fcu_emulator.emulator.agents.commands import TimeLimit
from fcu_emulator.emulator.agents.guides import INDEX, guide_text, guides
from fcu_emulator.emulator.agents.tools import TOOLS, Workbench, as_json, parse
from fcu_emulator.emulator.errors import FcuError, InputError, failure_text
from fcu_emulator.emulator.text import one_line

LONGEST_MESSAGE: Final = 1 << 20
"""Maximum size of a message in bytes. A longer message is answered as a message that is not JSON."""
PROGRESS_EVERY_S: Final = 5.0
"""Wall time between two reports of progress, for clients that ask for progress."""
SCHEME: Final = "fcu://docs/"
"""Beginning of the address of each guide."""
_LONGEST_ERROR: Final = 1000  # characters
_WAITING_MESSAGES: Final = 16
_TOO_LONG: Final = "a message that is too long"
_INSTRUCTIONS: Final = (
    "Virtual STM32F401 sensor board STEVAL-FCU001V1 for firmware of the lab LAB3. Edit main.c of a project, then call "
    "check: it builds the project, judges it exercise by exercise and explains failures. build only compiles; run plays "
    "a scenario. start_board, act, run_board, expect, registers, variables and transfers use a live board in virtual "
    "time; explain names the source line behind a wrong number. The text student.md (read_text) describes the lab."
)
_Context = ServerRequestContext[Any]
_Result = TypeVar("_Result")


class AgentServer:
    """A server for one client, which has started this process. ``version`` is shown to the client."""

    def __init__(self, version: str) -> None:
        self._bench = Workbench()
        self._commands = ThreadPoolExecutor(1, thread_name_prefix="commands")
        self._board = ThreadPoolExecutor(1, thread_name_prefix="board")
        self._stop: Callable[[], object] | None = None
        self._stopped = False
        self._server = Server[Any](
            "fcu-emulator",
            version=version,
            title="fcu-emulator",
            instructions=_INSTRUCTIONS,
            on_list_tools=self._list_tools,
            on_call_tool=self._call_tool,
            on_list_resources=self._list_resources,
            on_read_resource=self._read_resource,
        )

    def serve(self) -> None:
        """Serve until the client closes standard input, or until :meth:`stop`."""
        try:
            asyncio.run(self._serve())
        finally:
            self._commands.shutdown(wait=True, cancel_futures=True)
            self._board.submit(self._bench.close)
            self._board.shutdown(wait=True)

    def stop(self) -> None:
        """End the server soon. Signal handlers may call this."""
        self._stopped = True
        if self._stop is not None:
            self._stop()

    async def _serve(self) -> None:
        loop = asyncio.get_running_loop()
        with anyio.CancelScope() as scope:
            self._stop = partial(loop.call_soon_threadsafe, scope.cancel)
            if self._stopped:  # before the loop
                return
            messages = cast(anyio.AsyncFile[str], _Messages(loop))
            async with stdio_server(stdin=messages) as (received, sent):
                await self._server.run(received, sent, self._server.create_initialization_options())

    # -- Tools ----------------------------------------------------------------------------------------------

    async def _list_tools(
        self, context: _Context, params: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        del context, params
        return types.ListToolsResult(
            tools=[
                types.Tool(
                    name=one.name,
                    description=one.about,
                    input_schema=one.schema(),
                    annotations=types.ToolAnnotations(
                        read_only_hint=not one.changes, destructive_hint=False, open_world_hint=False
                    ),
                )
                for one in TOOLS.values()
            ]
        )

    async def _call_tool(
        self, context: _Context, params: types.CallToolRequestParams
    ) -> types.CallToolResult:
        async def report(passed_s: float) -> None:
            await context.session.report_progress(passed_s, message=f"{params.name}: {passed_s:.0f} s")

        try:
            wanted = parse(params.name, params.arguments or {})
            tool = TOOLS[params.name]
            limit = TimeLimit(tool.wall_s)
            threads = self._board if tool.on_board else self._commands
            call = partial(self._bench.call, params.name, wanted, limit)
            result = await _call(threads, limit, call, report)
        except Exception as error:
            text = one_line(failure_text(error), _LONGEST_ERROR)
            return types.CallToolResult(content=[types.TextContent(text=text)], is_error=True)
        return types.CallToolResult(
            content=[types.TextContent(text=as_json(result))], structured_content=result
        )

    # -- Guides ---------------------------------------------------------------------------------------------

    async def _list_resources(
        self, context: _Context, params: types.PaginatedRequestParams | None
    ) -> types.ListResourcesResult:
        del context, params
        index = types.Resource(
            uri=SCHEME + INDEX, name=INDEX, title="List of the guides", mime_type="text/plain"
        )
        pages = [
            types.Resource(
                uri=SCHEME + one.name,
                name=one.name,
                title=one.title,
                description=one.about,
                mime_type="text/markdown",
            )
            for one in guides()
        ]
        return types.ListResourcesResult(resources=[index, *pages])

    async def _read_resource(
        self, context: _Context, params: types.ReadResourceRequestParams
    ) -> types.ReadResourceResult:
        del context
        uri = str(params.uri)
        try:
            if not uri.startswith(SCHEME):
                raise InputError(f"a guide's address must begin with {SCHEME}, not {uri[:60]!r}")
            text = guide_text(uri.removeprefix(SCHEME))
        except FcuError as error:
            raise MCPError(code=types.INVALID_PARAMS, message=str(error)) from error
        kind = "text/markdown" if uri.endswith(".md") else "text/plain"
        contents = types.TextResourceContents(uri=uri, text=text, mime_type=kind)
        return types.ReadResourceResult(contents=[contents])


async def _call(
    threads: ThreadPoolExecutor,
    limit: TimeLimit,
    function: Callable[[], _Result],
    report: Callable[[float], Awaitable[None]],
) -> _Result:
    """Call a function in a thread. If this task is cancelled, the function ends soon.

    ``report`` is called with the passed wall time at intervals, because clients give up if no progress is reported.
    """

    def begin() -> _Result:
        limit.begin()
        return function()

    loop = asyncio.get_running_loop()
    began_s = loop.time()
    future = loop.run_in_executor(threads, begin)
    try:
        while not (await asyncio.wait({future}, timeout=PROGRESS_EVERY_S))[0]:
            await report(loop.time() - began_s)
    except asyncio.CancelledError:
        limit.cancel()
        raise
    return future.result()


class _Messages:
    """Lines of standard input. A thread reads them, and ends with the process."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lines: asyncio.Queue[str | None] = asyncio.Queue(_WAITING_MESSAGES)
        threading.Thread(target=self._read, daemon=True).start()

    async def __aiter__(self) -> AsyncIterator[str]:
        while (line := await self._lines.get()) is not None:
            yield line

    def _read(self) -> None:
        try:
            for line in lines_of_stream(partial(os.read, 0, 1 << 16)):
                self._put(line)
            self._put(None)
        except RuntimeError:  # the loop has been closed
            return

    def _put(self, line: str | None) -> None:
        asyncio.run_coroutine_threadsafe(self._lines.put(line), self._loop).result()


def lines_of_stream(read: Callable[[], bytes]) -> Any:
    """Yield the lines of a stream. A line that is too long is replaced by a short text that is not JSON."""
    kept, too_long = bytearray(), False
    while data := _read_some(read):
        *ended, rest = data.split(b"\n")
        for part in ended:
            kept += part
            yield _TOO_LONG if too_long or len(kept) > LONGEST_MESSAGE else kept.decode("utf-8", "replace")
            kept.clear()
            too_long = False
        kept += rest
        if len(kept) > LONGEST_MESSAGE:
            kept.clear()
            too_long = True


def _read_some(read: Callable[[], bytes]) -> bytes:
    try:
        return read()
    except OSError:  # the terminal or the pipe is gone
        return b""
