"""The USARTs (native/peripherals/usart.c) and the board's serial lines."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from fcu_emulator.emulator.buses.uart import BAUD, Uart
from fcu_emulator.emulator.chip.library import PERIPHERAL_CLASSES, FcuChip, NativePeripheral
from fcu_emulator.emulator.chip.peripherals.gpio import PORTS, PinFunction
from fcu_emulator.emulator.chip.registers.usart import CR1, CR2

_i32, _i64 = ctypes.c_int32, ctypes.c_int64
_SENT = ctypes.CFUNCTYPE(
    None, _i64, _i32, _i64, _i64, _i64, _i32, _i64, ctypes.POINTER(ctypes.c_uint8), _i32, _i32
)
_REPLACED = ctypes.CFUNCTYPE(None, _i64, _i32, _i32)


_KEPT = 0x1_0000  # number of bytes that are kept for a USART without a line

_STOP_BITS = (Fraction(1), Fraction(1, 2), Fraction(2), Fraction(3, 2))
"""Number of stop bits, by CR2.STOP."""


class UsartTable(ctypes.Structure):
    """struct UsartCalls of usart.h."""

    _fields_ = (("sent", _SENT), ("replaced", _REPLACED))


class Usart(NativePeripheral):
    """One USART."""

    def next_change_ps(self) -> int:
        at_ps: int = self._chip.library.fcu_usart_next_change(self._chip.handle, self.index)
        return at_ps


PERIPHERAL_CLASSES["USART"] = Usart


class ConnectedUsarts:
    """Connects each USART in ``lines`` to its line. The first output bytes of other USARTs are kept."""

    def __init__(self, chip: FcuChip, lines: Mapping[str, Uart]) -> None:
        self._chip = chip
        unconnected = {
            name: peripheral.index
            for name, peripheral in chip.peripherals.items()
            if isinstance(peripheral, Usart) and name not in lines
        }
        self._unconnected = unconnected
        self._output = {index: bytearray() for index in unconnected.values()}
        self._lines = {chip.peripherals[name].index: line for name, line in lines.items()}
        calls = UsartTable(chip.callback(_SENT, self._sent), chip.callback(_REPLACED, self._replaced))
        chip.library.fcu_connect_usarts(chip.handle, ctypes.addressof(calls))
        for name, line in lines.items():
            line.connect(_Transceiver(chip, chip.peripherals[name]))

    def _sent(  # C calls it with these arguments
        self, peripheral: int, start_ps: int, num: int, den: int, connected: int, first: int, *piece: Any
    ) -> None:
        data, length, detailed = piece
        line = self._lines.get(peripheral)
        if line is None:
            output = self._output[peripheral]
            output += bytes(data[: min(length, _KEPT - len(output))])
            return
        if first == 0:
            line.open_run(start_ps, Fraction(num, den), connected=bool(connected))
        line.carry(bytes(data[:length]), detailed=bool(detailed))

    def unconnected_output(self) -> dict[str, bytes]:
        """Return the first bytes of USARTs without a line, keyed by name."""
        clock = self._chip.clock
        now_ps = clock.now_ps
        for index in self._output:
            self._chip.library.fcu_usart_flush(self._chip.handle, index)
        clock.now_ps = now_ps
        return {name: bytes(self._output[n]) for name, n in self._unconnected.items() if self._output[n]}

    def _replaced(self, peripheral: int, value: int) -> None:
        if peripheral in self._lines:
            self._lines[peripheral].replace_last(value)


def wire_terminal(chip: FcuChip, name: str, pin: PinFunction, baud: int = BAUD) -> None:
    """Connect a terminal at ``baud`` to a USART's ``pin``. A note reports a wrong rate."""
    port, number, function = pin
    index = chip.peripherals[name].index
    chip.library.fcu_usart_wire(chip.handle, index, PORTS.index(port), number, function, baud)


class _Transceiver:
    """The line's side of a USART: :class:`fcu_emulator.emulator.buses.uart.Transceiver`."""

    def __init__(self, chip: FcuChip, peripheral: NativePeripheral) -> None:
        self._chip = chip
        self._peripheral = peripheral
        self._place = chip.handle, peripheral.index

    def flush(self) -> None:
        clock = self._chip.clock
        now_ps = clock.now_ps
        self._chip.library.fcu_usart_flush(*self._place)
        clock.now_ps = now_ps

    def frame_ps(self) -> Fraction | None:
        num, den = _i64(), _i64()
        has_clock = self._chip.library.fcu_usart_frame(
            *self._place, ctypes.addressof(num), ctypes.addressof(den)
        )
        return Fraction(num.value, den.value) if has_clock else None

    def frame_bits(self) -> Fraction:
        data_bits = 9 if CR1.M.get(self._peripheral.peek(CR1.addr)) else 8
        return 1 + data_bits + _STOP_BITS[CR2.STOP.get(self._peripheral.peek(CR2.addr))]

    def receive(self, value: int) -> bool:
        self._chip.enter()
        taken = bool(self._chip.library.fcu_usart_receive(*self._place, value))
        self._chip.raise_error()
        return taken

    def line_idle(self) -> None:
        self._chip.enter()
        self._chip.library.fcu_usart_line_idle(*self._place)
        self._chip.raise_error()
