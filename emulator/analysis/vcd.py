"""``--vcd FILE``: the wires as a value change dump (IEEE 1364), for GTKWave, PulseView, sigrok.

Decision: all wires in the VCD file have one bit, because sigrok stops reading at a vector.

The package pyvcd (extra ``views``) writes the file and requires increasing times, so edges are kept
for ``HELD_PS`` and then written. Longer transfers are omitted and counted.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

from fcu_emulator.emulator.analysis import waves
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_S, PS_PER_US, Periodic
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.host.files import BoundedFile
from fcu_emulator.emulator.trace import LARGEST_FILE, BusTransfer, GpioEdge, TerminalBytes, TraceEvent

LOOK_PS = 20 * PS_PER_US
HELD_PS = PS_PER_S
_TICK_PS = 10_000
_FLUSH_EVERY = 5_000  # samples


class VcdFile:
    """Writer of ``board``'s events from now on. Raises InputError without pyvcd, or LinkError."""

    def __init__(self, board: Board, path: Path, most_bytes: int = LARGEST_FILE) -> None:
        writer_class = _writer_class()
        self._board = board
        self._file = BoundedFile(path, f"--vcd {path}", most_bytes)
        self._writer = writer_class(
            self._file,
            timescale="10 ns",
            date="0 is power-on",
            comment=board.description.name,
            init_timestamp=board.clock.now_ps // _TICK_PS,
        )
        self._wires: dict[str, Any] = {}
        self._levels: dict[str, int] = {}
        self._waiting: list[tuple[int, int, str, int]] = []
        self._count = self._looks = 0
        self._written_ps = board.clock.now_ps
        self._callback = f"{board.timer.name}_callback"
        self.left_out = 0
        """Number of omitted messages, which were incomplete or took too long."""
        self._declare()
        self._unsubscribe = board.trace.subscribe(self._handle)
        self._looking = Periodic(board.clock, board.clock.now_ps, Fraction(LOOK_PS), self._look)
        self._closed = False

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        board = self._board
        board.terminal.uart.catch_up()
        self._looking.cancel()
        self._unsubscribe()
        try:
            self._write(board.clock.now_ps)
            self._writer.close(board.clock.now_ps // _TICK_PS)
        finally:
            self._file.close()

    def report(self) -> list[str]:
        if not self.left_out:
            return []
        most = f"{HELD_PS // PS_PER_S} s"
        return [f"--vcd: {self.left_out} messages are omitted: incomplete, or longer than {most}"]

    # -- the wires --------------------------------------------------------------------------------------

    def _declare(self) -> None:
        board, wiring = self._board, self._board.booted.wiring
        bus = wiring.bus
        if bus in board.signals.i2c:
            self._wire(bus, "SCL", 1)
            self._wire(bus, "SDA", 1)
        else:
            self._wire(bus, "SCK", board.signals.spi[bus].mode >> 1)
            self._wire(bus, "SDIO", 0)
            for name in wiring.places:
                self._wire(bus, f"CS_{name}", 1)
        line = board.terminal.uart.name
        self._wire(line, "TX", 1)
        self._wire(line, "RX", 1)
        for name, led in board.leds.items():
            self._wire("LEDs", name, int(led.on))
        for part in board.sensors:
            for pin in part.pins():
                wire = self._wire(part.NAME, pin.name.upper(), pin.level or 0)
                pin.observe(self._edge_of(wire))
        self._wire("firmware", self._callback, 0)

    def _wire(self, scope: str, name: str, level: int) -> str:
        wire = f"{scope}.{name}"
        shown = f"{scope}_{name}".replace("/", "_")
        self._wires[wire] = self._writer.register_var(f"board.{scope}", shown, "wire", 1, level)
        self._levels[wire] = level
        return wire

    # -- the events -------------------------------------------------------------------------------------

    def _handle(self, event: TraceEvent) -> None:
        if isinstance(event, BusTransfer):
            self._add(self._drawn(event))
        elif isinstance(event, TerminalBytes):
            uart = self._board.terminal.uart
            wire = f"{uart.name}.{'TX' if event.direction == 'tx' else 'RX'}"
            bit_ps = Fraction(PS_PER_S) / Fraction(uart.bit_rate).limit_denominator()
            frame_ps = Fraction(uart.frames_ps(1_000_000), 1_000_000)
            self._add(waves.frames(event.t_ps, event.data, frame_ps, bit_ps, wire))
        elif isinstance(event, GpioEdge):
            for name, led in self._board.leds.items():
                if led.pin == event.pin:
                    self._put(event.t_ps, f"LEDs.{name}", int(led.on))

    def _drawn(self, transfer: BusTransfer) -> Iterable[waves.Edge]:
        bus = transfer.bus
        edges: Iterable[waves.Edge] | None = None
        if transfer.t_ps >= self._written_ps and f"{bus}.SCL" in self._wires:
            edges = waves.i2c(transfer, f"{bus}.SCL", f"{bus}.SDA")
        elif transfer.t_ps >= self._written_ps and f"{bus}.CS_{transfer.device}" in self._wires:
            mode = self._board.signals.spi[bus].mode
            edges = waves.spi(transfer, mode, f"{bus}.SCK", f"{bus}.SDIO", f"{bus}.CS_{transfer.device}")
        self.left_out += edges is None
        return edges or ()

    def _edge_of(self, wire: str) -> Callable[[int, int], None]:
        def edge(at_ps: int, level: int) -> None:
            self._put(at_ps, wire, level)

        return edge

    def _look(self) -> None:
        board = self._board
        running = board.handles(board.timer.name)
        self._put(board.clock.now_ps, f"firmware.{self._callback}", int(running))
        self._looks += 1
        if self._looks % _FLUSH_EVERY == 0:
            board.terminal.uart.catch_up()
            self._write(board.clock.now_ps - HELD_PS)

    def _add(self, edges: Iterable[waves.Edge]) -> None:
        for edge in edges:
            self._put(*edge)

    def _put(self, at_ps: int, wire: str, level: int) -> None:
        if wire == f"firmware.{self._callback}":  # this wire is sampled often and changes rarely
            if self._levels[wire] == level:
                return
            self._levels[wire] = level
        self._count += 1
        if not self._closed:
            heapq.heappush(self._waiting, (at_ps, self._count, wire, level))

    def _write(self, until_ps: int) -> None:
        waiting = self._waiting
        while waiting and waiting[0][0] <= until_ps:
            at_ps, _, wire, level = heapq.heappop(waiting)
            at_ps = max(at_ps, self._written_ps)
            self._written_ps = at_ps
            self._writer.change(self._wires[wire], at_ps // _TICK_PS, level)
        self._written_ps = max(self._written_ps, until_ps)


def _writer_class() -> Any:
    try:
        from vcd import VCDWriter
    except ImportError as error:
        raise InputError("--vcd needs pyvcd; install it: pip install 'fcu-emulator[views]'") from error
    return VCDWriter
