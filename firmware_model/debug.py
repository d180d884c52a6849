"""PRINTF, the lab's way to the terminal.

Decision: ``vsnprintf`` into 255 bytes, so at most 254 characters reach the line, as the brief says. ST's
stock ``myprintf`` (board facts, section 4) passes 254 as the limit but then sends the *untruncated* length,
reading past its buffer; the lab's wording is followed instead.
"""

from __future__ import annotations

from firmware_model.cprintf import CArgument, sprintf
from firmware_model.hal import Hal

PRINTF_LIMIT = 254  # a 255-byte buffer less the terminating zero
PRINTF_TIMEOUT_MS = 1000


def PRINTF(hal: Hal, fmt: str, *args: CArgument) -> None:
    """Format as C does and send the first 254 bytes in one blocking transmit.

    The status is not looked at: a busy UART loses the text, as on the board.
    """
    hal.HAL_UART_Transmit(sprintf(fmt, *args)[:PRINTF_LIMIT], PRINTF_TIMEOUT_MS)
