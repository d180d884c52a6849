"""``--perfetto FILE``: a run's time line for https://ui.perfetto.dev and ``chrome://tracing``.

The stack is sampled every ``LOOK_PS``, so shorter calls may be missing.

Decision: the Perfetto file is JSON in the "Trace Event Format" (Google, 2016), which both viewers
and any program can read.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from typing import Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US, Periodic
from fcu_emulator.emulator.host.files import BoundedFile
from fcu_emulator.emulator.trace import (
    LARGEST_FILE,
    BusTransfer,
    DeviceNote,
    Fault,
    GpioEdge,
    TerminalBytes,
    TickLate,
    TickLost,
    TraceEvent,
)

LOOK_PS = 100 * PS_PER_US
_LOAD_EVERY = 200  # samples
_MOST_ARGUMENT_BYTES = 64
_PROCESS = 1
_FIRMWARE, _NOTES, _SERIAL, _FIRST_BUS = 1, 2, 3, 10
_SP, _LR, _PC = 13, 14, 15


class PerfettoFile:
    """Writer of ``board``'s events from now on. Raises LinkError for an unusable file."""

    def __init__(self, board: Board, path: Path, most_bytes: int = LARGEST_FILE) -> None:
        self._board = board
        self._file = BoundedFile(path, f"--perfetto {path}", most_bytes)
        self._first = True
        self._stack_now = _stack_of(board)
        self._open: list[tuple[str, int]] = []  # functions in execution, the outermost first, and start times
        self._looks = self._in_callback = 0
        self._closed = False
        signals = board.signals
        self._buses = {name: _FIRST_BUS + at for at, name in enumerate((*signals.i2c, *signals.spi))}
        self._file.write('{"displayTimeUnit":"ms","traceEvents":[\n')
        self._name_rows()
        self._unsubscribe = board.trace.subscribe(self._handle)
        self._looking = Periodic(board.clock, board.clock.now_ps, Fraction(LOOK_PS), self._look)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        self._looking.cancel()
        self._unsubscribe()
        try:
            self._show_stack([])
            self._file.write("\n]}\n")
        finally:
            self._file.close()

    def report(self) -> list[str]:
        return []

    def _name_rows(self) -> None:
        board = self._board
        rows = {_FIRMWARE: "firmware", _NOTES: "notes", _SERIAL: board.terminal.uart.name}
        rows |= {number: name for name, number in self._buses.items()}
        title = f"{board.description.name}, {board.booted.name}"
        self._write({"ph": "M", "name": "process_name", "args": {"name": title}})
        for row, name in rows.items():
            self._write({"ph": "M", "name": "thread_name", "tid": row, "args": {"name": name}})
            self._write({"ph": "M", "name": "thread_sort_index", "tid": row, "args": {"sort_index": row}})

    # -- functions ------------------------------------------------------------------------------------------

    def _look(self) -> None:
        board = self._board
        self._show_stack(self._stack_now())
        self._looks += 1
        self._in_callback += board.handles(board.timer.name)
        if self._looks == _LOAD_EVERY:
            share = 100 * self._in_callback / _LOAD_EVERY
            self._counter("callback", {f"{board.timer.name} %": round(share, 1)})
            self._looks = self._in_callback = 0

    def _show_stack(self, functions: list[str]) -> None:
        now_ps = self._board.clock.now_ps
        before = [name for name, _ in self._open]
        if (
            functions and functions[0] in before[1:]
        ):  # the callers of the function were not found in this sample
            functions = before[: before.index(functions[0])] + functions
        same = 0
        for (was, _), now in zip_longest(self._open, functions, fillvalue=("", 0)):
            if not was or was != now:
                break
            same += 1
        while len(self._open) > same:
            name, began_ps = self._open.pop()
            self._span(_FIRMWARE, name, began_ps, now_ps)
        self._open += [(name, now_ps) for name in functions[same:]]

    # -- other rows -----------------------------------------------------------------------------------------

    def _handle(self, event: TraceEvent) -> None:
        board = self._board
        if isinstance(event, BusTransfer):
            name = f"{event.device or f'0x{event.address:02X}'} {event.register}".strip()
            data = {
                "written": event.written[:_MOST_ARGUMENT_BYTES].hex(" "),
                "read": event.read[:_MOST_ARGUMENT_BYTES].hex(" "),
                "bytes": len(event.written) + len(event.read),
                "result": event.result,
            }
            self._span(self._buses[event.bus], name, event.t_ps, event.end_ps, data)
        elif isinstance(event, TerminalBytes):
            text = event.data[:_MOST_ARGUMENT_BYTES].decode("latin-1")
            end_ps = event.t_ps + board.terminal.uart.frames_ps(len(event.data))
            self._span(_SERIAL, event.direction, event.t_ps, end_ps, {"text": text, "bytes": len(event.data)})
        elif isinstance(event, GpioEdge):
            for name, led in board.leds.items():
                if led.pin == event.pin:
                    self._counter(name, {"on": int(led.on)})
        elif isinstance(event, TickLate):
            self._note(event, f"{event.timer} tick {event.late_ps / PS_PER_MS:.3f} ms late")
        elif isinstance(event, TickLost):
            self._note(event, f"{event.timer}: {event.count} ticks lost")
        elif isinstance(event, Fault):
            self._note(event, f"{event.where}: {event.text}")
        elif isinstance(event, DeviceNote):
            self._note(event, f"{event.device}: {event.text}")

    def _span(
        self, row: int, name: str, begin_ps: int, end_ps: int, arguments: dict[str, Any] | None = None
    ) -> None:
        event = {"ph": "X", "name": name, "tid": row, "ts": _us(begin_ps), "dur": _us(end_ps - begin_ps)}
        self._write(event | ({"args": arguments} if arguments else {}))

    def _note(self, event: TraceEvent, text: str) -> None:
        self._write({"ph": "i", "s": "t", "name": text, "tid": _NOTES, "ts": _us(event.t_ps)})

    def _counter(self, name: str, values: dict[str, float]) -> None:
        self._write({"ph": "C", "name": name, "ts": _us(self._board.clock.now_ps), "args": values})

    def _write(self, event: dict[str, Any]) -> None:
        text = json.dumps({"pid": _PROCESS} | event, separators=(",", ":"))
        self._file.write(text if self._first else f",\n{text}")
        self._first = False


def _us(ps: int) -> float:
    return ps / PS_PER_US


def _stack_of(board: Board) -> Callable[[], list[str]]:
    firmware = board.chip
    if firmware is None:
        timer = board.timer.name

        def python_stack() -> list[str]:
            return ["main", f"{timer} callback"] if board.handles(timer) else ["main"]

        return python_stack

    from fcu_emulator.emulator.chip.diagnosis.backtrace import Backtrace, Places

    core = firmware.chip.core
    places = Places(firmware.image)
    backtrace = Backtrace(places, core.peek, core.memory)
    names: dict[int, str] = {}

    def name_of(address: int) -> str:
        if address not in names:
            names[address] = places.function_name(address) or f"0x{address:08X}"
        return names[address]

    def chip_stack() -> list[str]:
        calls = backtrace.calls(core.register(_PC), core.register(_LR), core.register(_SP))
        return [name_of(call.address) for call in reversed(calls)]

    return chip_stack
