"""``fcu mcp``: serve the board to a coding agent, until the agent ends the server."""

from __future__ import annotations

import importlib.util
import sys

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.run import interruptible
from fcu_emulator.emulator.cli.screen import say
from fcu_emulator.emulator.errors import InputError

_EXTRA = 'fcu mcp needs the SDK of the Model Context Protocol; install it: pip install "fcu-emulator[mcp]"'


def serve_agent() -> ExitCode:
    """Serve on standard input and output. Raises InputError without the SDK."""
    if importlib.util.find_spec("mcp") is None:
        raise InputError(_EXTRA)
    try:
        from fcu_emulator.emulator.agents.server import AgentServer
    except ImportError as error:  # another package with this name, or an old version
        raise InputError(f"{_EXTRA} ({error})") from error
    from importlib.metadata import version

    if sys.stdin is None:
        raise InputError("fcu mcp needs standard input, on which the agent's client sends requests")
    server = AgentServer(version("fcu-emulator"))
    if sys.stdin.isatty():
        say("the agent's client starts this command (see docs/agents.md); Ctrl-C ends it")
    with interruptible(server) as ended:
        server.serve()
    return ExitCode.INTERRUPTED if ended else ExitCode.PASSED
