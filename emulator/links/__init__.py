"""Byte links connect the virtual serial line to the outside."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links.byte_link import Addressed, ByteLink, MemoryLink
from fcu_emulator.emulator.links.stdout import StdoutLink

__all__ = ["Addressed", "ByteLink", "MemoryLink", "StdoutLink", "open_link"]

CHOICES = "stdout, port, pty, pty:/path/of/a/link, tcp, tcp:PORT, rfc2217, rfc2217:PORT or file:PATH"


def open_link(
    spec: str,
    firmware_baud: Callable[[], float] = lambda: 115_200.0,
    say: Callable[[str], None] = lambda _line: None,
) -> ByteLink:
    """Open the link ``spec``, one of ``CHOICES``.

    ``port`` is the same as ``pty``, or as ``tcp`` on systems without pseudo-terminals. ``firmware_baud()`` returns the
    USART's rate. ``say(line)`` receives messages. Raises LinkError for an unknown or unsupported
    ``spec``.
    """
    kind, colon, name = spec.partition(":")
    if spec == "stdout":
        return StdoutLink()
    if spec == "port":
        kind = "pty" if sys.platform != "win32" else "tcp"
    if kind == "pty" and (name or not colon):
        return _open_pty(Path(name) if name else None)
    if kind == "file" and name:
        from fcu_emulator.emulator.links.file import FileLink

        return FileLink(Path(name))
    if kind in ("tcp", "rfc2217") and (name or not colon):
        from fcu_emulator.emulator.links.tcp import TcpLink, parse_port

        port = parse_port(kind, name) if name else None
        if kind == "tcp":
            return TcpLink(port)
        from fcu_emulator.emulator.links.rfc2217 import Rfc2217Link  # pyserial: 30 ms

        return Rfc2217Link(port, firmware_baud, say)
    raise LinkError(f"--serial must be {CHOICES}, not {spec!r}", kind="unknown_link")


def _open_pty(link_path: Path | None) -> ByteLink:
    if sys.platform != "win32":
        from fcu_emulator.emulator.links.pty import PtyLink  # needs termios and fcntl, which Windows lacks

        return PtyLink(link_path)
    raise LinkError(
        "cannot open --serial pty: Windows has no pseudo-terminals; use --serial tcp", kind="no_pty"
    )
