"""Byte links: how the virtual board's serial line reaches the outside.

``open_link`` turns the word after ``--serial`` into a link; the board knows only the ``ByteLink`` protocol.
"""

from __future__ import annotations

import sys
from pathlib import Path

from emulator.errors import LinkError
from emulator.links.byte_link import ByteLink, MemoryLink
from emulator.links.stdout import StdoutLink

__all__ = ["ByteLink", "MemoryLink", "StdoutLink", "open_link"]


def open_link(spec: str) -> ByteLink:
    """Open the link that ``spec`` names: ``stdout``, ``pty``, or ``pty:/some/link`` for a name of one's own.

    Raises LinkError if ``spec`` is none of these or this machine cannot give it.
    """
    kind, colon, name = spec.partition(":")
    if spec == "stdout":
        return StdoutLink()
    if kind == "pty" and (name or not colon):
        return _open_pty(Path(name) if name else None)
    raise LinkError(f"--serial {spec}: unknown link; choose stdout, pty or pty:/path/of/a/link")


def _open_pty(link_path: Path | None) -> ByteLink:
    if sys.platform != "win32":
        from emulator.links.pty import PtyLink  # needs termios and fcntl, which Windows lacks

        return PtyLink(link_path)
    raise LinkError("--serial pty: Windows has no pseudo-terminals; use --serial stdout")
