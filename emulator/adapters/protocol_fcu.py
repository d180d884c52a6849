"""A board as a pyserial port: ``serial.serial_for_url("fcu://solution?scenario=desk")``.

Import this module first. The board runs only during calls of the port, such as ``read``.
``timeout`` is in virtual time. The address is ``fcu://FIRMWARE``, with optional
``?scenario=...&wiring=...&seed=...&ideal=1``. ``port.board`` is the board.

Decision: reading the number of available bytes (``in_waiting``) runs the board for a millisecond if
no bytes are available, because programs poll this number.
"""

from __future__ import annotations

from typing import Any
from urllib.parse import parse_qsl, unquote

import serial

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.clock import PS_PER_MS, to_ps
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.renamed import with_current_keys

SILENCE_S = 60.0
"""Virtual time after which a read without a timeout raises an error."""
_STEP_PS = PS_PER_MS
_KNOWN = {"scenario", "wiring", "seed", "ideal"}
_OLD = {"profile": "wiring"}
"""Old option names, from the previous release."""

if __package__ not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append(__package__)


def port_of(board: Board, timeout: float | None = None) -> Serial:
    """Return an open port of ``board``. The first reads return the output from before this call."""
    port = Serial(None, timeout=timeout)
    port.board = board
    port.is_open = True
    return port


class Serial(serial.SerialBase):  # type: ignore[misc]  # pyserial has no types
    """A pyserial port. ``board`` is None until the port is open."""

    board: Board | None = None
    is_open: bool
    _position = 0

    def open(self) -> None:
        """Create and switch on the board. Raises SerialException."""
        if self.is_open:
            raise serial.SerialException("the port is open already")
        try:
            self.board = _board(self.portstr)
        except InputError as error:
            raise serial.SerialException(f"{self.portstr}: {error}") from error
        self._position = 0
        self.is_open = True

    def close(self) -> None:
        if self.is_open and self.board is not None:
            self.board.close()
        self.is_open = False

    def _reconfigure_port(self) -> None:
        """Accept any rate or format."""

    @property
    def in_waiting(self) -> int:
        board = self._opened()
        waiting = board.terminal.position - self._position
        if not waiting:
            board.run_until_ps(board.clock.now_ps + _STEP_PS)
            waiting = board.terminal.position - self._position
        return waiting

    def read(self, size: int = 1) -> bytes:
        """Run until ``size`` bytes arrive, or for ``timeout`` virtual seconds.

        Raises SerialException if a read without a timeout gets too few bytes in ``SILENCE_S``.
        """
        board = self._opened()
        limit_s = SILENCE_S if self._timeout is None else self._timeout
        deadline_ps = board.clock.now_ps + to_ps(limit_s)
        while (missing := self._position + size - board.terminal.position) > 0:
            left_ps = deadline_ps - board.clock.now_ps
            if left_ps <= 0:
                if self._timeout is None:
                    silent = f"{missing} of {size} bytes did not arrive within {limit_s:g} s of virtual time"
                    raise serial.SerialException(f"{silent}; read with a timeout")
                break
            board.run_until_ps(board.clock.now_ps + min(_STEP_PS, left_ps))
        printed, end = board.terminal.since(self._position)
        data = printed[:size]
        self._position = end - len(printed) + len(data)
        return data

    def write(self, data: Any) -> int:
        typed = bytes(serial.to_bytes(data))
        self._opened().terminal.write(typed)
        return len(typed)

    def flush(self) -> None:
        board = self._opened()
        while board.terminal.typing_left:
            board.run_until_ps(board.clock.now_ps + _STEP_PS)

    def reset_input_buffer(self) -> None:
        self._position = self._opened().terminal.position

    def reset_output_buffer(self) -> None:
        """Do nothing: typed bytes are already on the wire."""

    @property
    def out_waiting(self) -> int:
        return self._opened().terminal.typing_left

    @property
    def cts(self) -> bool:
        return True

    dsr = cd = cts

    @property
    def ri(self) -> bool:
        return False

    def _update_break_state(self) -> None:
        """Do nothing: the board has no break, RTS or DTR."""

    _update_rts_state = _update_dtr_state = _update_break_state

    def _opened(self) -> Board:
        if not self.is_open or self.board is None:
            raise serial.PortNotOpenError
        return self.board


def _board(url: str) -> Board:
    """Return the board for an address. Raises InputError."""
    firmware, _, query = url.removeprefix("fcu://").partition("?")
    options = with_current_keys(dict(parse_qsl(query, keep_blank_values=True)), _OLD)
    if unknown := options.keys() - _KNOWN:
        raise InputError(f"unknown option {min(unknown)!r}; known: {', '.join(sorted(_KNOWN))}")
    seed = options.get("seed")
    if seed is not None and not seed.removeprefix("-").isdigit():
        raise InputError(f"seed must be a whole number, not {seed!r}")
    scenario = options.get("scenario")
    return Board(
        unquote(firmware) or (FCU001V1.default_firmware if scenario is None else None),
        scenario=scenario,
        wiring=options.get("wiring"),
        seed=None if seed is None else int(seed),
        ideal=options.get("ideal", "0") not in ("0", "false", ""),
    )
