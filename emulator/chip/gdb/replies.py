"""The short answers ("Packets"): done, not understood, cannot be done."""

from __future__ import annotations

from typing import Final

OK: Final = b"OK"
MALFORMED, REFUSED = b"E01", b"E02"
