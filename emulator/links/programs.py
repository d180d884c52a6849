"""Commands, quoted for the shell, that open a link with this system's terminal programs."""

from __future__ import annotations

import sys
from pathlib import Path

from fcu_emulator.emulator.host.install_hints import quoted
from fcu_emulator.emulator.host.loopback import HOST


def miniterm() -> str:
    """Return the command of pyserial's terminal.

    PowerShell cannot run a quoted path. On Windows, ``python`` replaces such a path.
    """
    python = quoted(sys.executable)
    if sys.platform == "win32" and python != sys.executable:
        python = "python"
    return f"{python} -m serial.tools.miniterm"


def for_pty(path: Path) -> list[str]:
    """Return the commands for a pseudo-terminal."""
    port = quoted(str(path))
    return [
        f"fcu terminal {port}",
        f"screen {port} 115200",
        f"minicom -D {port} -b 115200",
        f"{miniterm()} {port} 115200",
        f"putty -serial {port} -sercfg 115200,8,n,1,N",
    ]


def for_tcp(port: int) -> list[str]:
    """Return the commands for raw TCP."""
    commands = [
        f"fcu terminal tcp:{port}",
        f"{miniterm()} socket://{HOST}:{port}",
        f"putty -raw {HOST} -P {port}",
    ]
    if sys.platform == "win32":
        commands.append(f"ttermpro {HOST}:{port} /nossh /T=0")
    return commands


def for_rfc2217(port: int, baud: int = 115_200) -> list[str]:
    """Return the commands for Telnet with RFC 2217."""
    commands = [
        f"fcu terminal rfc2217:{port}",
        f"{miniterm()} rfc2217://{HOST}:{port} {baud}",
        f"putty -telnet {HOST} -P {port}",
    ]
    if sys.platform == "win32":
        commands.append(f"ttermpro {HOST}:{port} /nossh /T=1")
    return commands
