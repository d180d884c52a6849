"""I2C1 to I2C3 as bus master (RM0368 section 18): registers, settings, interrupts, DMA.

What happens on the wire and when is ``i2c_sequence``, the bus itself :mod:`emulator.i2c_wire`. Polled flags
need no event: reading SR1 carries out what has become due until then.

Not modelled, and told when used: slave mode (the board has no other master), PEC and SMBus. The sensors never
stretch the clock. The digital filter (FLTR) is stored.
"""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

from emulator.arm.cpu.native_bus import NativeBus
from emulator.arm.cpu.slice import Slice
from emulator.arm.peripherals import i2c_registers, i2c_timing
from emulator.arm.peripherals.i2c_registers import (
    ADDR,
    BTF,
    BUSY,
    CCR,
    CR1,
    CR2,
    DMAEN,
    DR,
    FREQ,
    ITBUFEN,
    ITERREN,
    ITEVTEN,
    LAST,
    NOT_MODELLED,
    PE,
    RXNE,
    SB,
    SR1,
    SR2,
    START,
    STOP,
    SWRST,
    TRISE,
    TXE,
)
from emulator.arm.peripherals.i2c_sequence import Sequence
from emulator.arm.peripherals.irq_line import IrqLine
from emulator.arm.peripherals.native_i2c import NativeSequence
from emulator.arm.peripherals.peripheral import ALREADY_PS, WORD, Peripheral
from emulator.arm.peripherals.pins import PinFunction, unconnected
from emulator.arm.soc import Soc
from emulator.clock import PS_PER_S
from emulator.i2c import I2CBus
from emulator.i2c_wire import I2CWire

_ERRORS = 0xDF00  # flags that software clears by writing 0
_EVENTS = SB | ADDR | BTF
_TOLD = {offset: sum(texts) for offset, texts in NOT_MODELLED.items()}
_INTERRUPTS = {"I2C1": (31, 32), "I2C2": (33, 34), "I2C3": (72, 73)}  # event, error (RM0368 table 38)


class I2c(Peripheral):
    """``name`` is "I2C1" to "I2C3"; ``pins`` are SCL and SDA: until they are switched nobody answers."""

    REGISTERS: ClassVar[dict[int, int]] = i2c_registers.RESET
    NAMES: ClassVar[dict[int, str]] = i2c_registers.NAMES
    WRITABLE: ClassVar[dict[int, int]] = i2c_registers.WRITABLE

    def __init__(
        self,
        soc: Soc,
        name: str,
        base: int,
        bus: I2CBus,
        pins: tuple[PinFunction, ...] = (),
        size: int = 0x400,
    ) -> None:
        super().__init__(soc, name, base, size)
        self._bus = bus
        self._wire = I2CWire(bus)
        self._pins = pins
        self._connected_since = -1  # the pins are as they were then, and connected
        self._sequence: Sequence = Sequence(soc.clock, self._wire, self._connected, self._update, self.note)
        event, error = _INTERRUPTS[name]
        self._event_irq, self._error_irq = IrqLine(soc, event), IrqLine(soc, error)
        self._serving = False
        soc.clocks.on_change(self._set_rate)
        for direction in ("TX", "RX"):
            soc.dma.connect(f"{name}_{direction}", self._update)

    def go_native(self, native: NativeBus, run: Slice) -> None:
        """The native engine executes the firmware, and does the sequence; before anything has happened."""
        parts = self._wire, self._connected, self._update, self.note
        self._sequence = NativeSequence.make(native, run, self.base, self.clocked, *parts)

    def reset(self) -> None:
        """All registers; a message under way is abandoned."""
        super().reset()
        self._sequence.reset()
        self._sequence.watched = False
        self._set_rate()
        self._lines()

    def gate(self, *, clocked: bool) -> None:
        """RCC switches the clock of the block on or off."""
        super().gate(clocked=clocked)
        self._sequence.clocked = clocked

    # -- access -----------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """SR1, then SR2 clears ADDR; DR takes a byte from the receiver."""
        self._sequence.settle()
        if offset == SR1:
            self._sequence.seen = status = self._sequence.status1
            return status
        if offset == SR2:
            return self._read_sr2()
        if offset == DR:
            return self._read_data()
        return self.peek(offset)

    def look(self, offset: int) -> tuple[int, int]:
        """SR1 is what polling loops read; a held line changes SR2 only."""
        self._sequence.settle()
        if offset == DR:
            return self._read_data(), ALREADY_PS
        if offset != SR1:
            return super().look(offset)
        sequence = self._sequence
        sequence.seen = status = sequence.status1
        return status, sequence.due_ps

    def peek(self, offset: int) -> int:
        """The same without clearing or taking anything."""
        sequence = self._sequence
        if offset == SR1:
            return sequence.status1
        if offset == SR2:
            return sequence.status2 | BUSY if self._wire.held() else sequence.status2
        if offset == DR:
            return sequence.data
        return sequence.control if offset == CR1 else self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """CR1 starts and stops, DR sends, SR1 clears errors, the others configure."""
        self._sequence.settle()
        if offset == DR:
            self._sequence.write_data(value & 0xFF)
        elif offset == SR1:
            self._sequence.status1 &= value | ~(mask & _ERRORS)
        elif offset == CR1:
            mask &= self.WRITABLE[CR1]
            self._control(self._sequence.control & ~mask | value & mask)
        else:
            super().write(offset, value, mask)
            self._configured(offset)
        if self._sequence.watched:
            self._update()

    def pure_read(self, offset: int) -> bool:
        """Polling may be skipped, but for DR, and SR2 while it clears ADDR."""
        return offset != DR and not (offset == SR2 and self._sequence.status1 & ADDR)

    def next_change_ps(self) -> int:
        """When the operation under way ends, or a line that is held low is let go."""
        due_ps = self._sequence.due_ps
        return min(due_ps, self._wire.released_ps()) if self._wire.held() else due_ps

    def _read_sr2(self) -> int:
        status = self.peek(SR2)
        sequence = self._sequence
        if sequence.seen & sequence.status1 & ADDR:
            sequence.seen = 0
            sequence.clear_addr()
            self._update()
        return status

    def _read_data(self) -> int:
        value = self._sequence.read_data()
        if self._sequence.watched:
            self._update()
        return value

    # -- settings ---------------------------------------------------------------------------------------

    def _control(self, new: int) -> None:
        old = self._sequence.control
        self._tell(CR1, new)
        if new & SWRST:
            self.reset()
            self._sequence.control = SWRST
        elif not new & PE:
            if old & PE:
                self._sequence.reset()
            self._sequence.control = new & ~(START | STOP)
        else:
            if not old & PE:
                self._sequence.control = PE
                self._set_rate()
            if new & START and not self._sequence.checked:
                self._check_settings()
            self._sequence.request(new)

    def _configured(self, offset: int) -> None:
        self._tell(offset, self.registers[offset])
        if offset == CR2:
            self._sequence.watched = bool(self.registers[CR2] & (ITERREN | ITEVTEN | DMAEN))
            self._sequence.plan_again()
            self._lines()
        elif offset in (CCR, TRISE) and self._sequence.control & PE:
            self.note("forbidden", f"{self.NAMES[offset]} written while PE in CR1 is 1")
        if offset == CCR:
            self._set_rate()
        self._sequence.checked = False

    def _tell(self, offset: int, value: int) -> None:
        if not value & _TOLD.get(offset, 0):
            return
        for bits, text in NOT_MODELLED[offset].items():
            if value & bits:
                self.note("not modelled", text)

    def _set_rate(self) -> None:
        self._sequence.checked = False
        period = i2c_timing.period_ps(self.registers[CCR], self.soc.clocks.pclk1_hz)
        if period is not None:
            period = max(period, Fraction(self._bus.shortest_ps))
        self._sequence.set_period(period)
        if period is not None and self._sequence.control & PE:
            speed_hz = round(PS_PER_S / period)
            if speed_hz != self._bus.speed_hz:
                self._bus.set_speed(speed_hz)

    def _check_settings(self) -> None:
        self._sequence.checked = True
        ccr, trise, freq = self.registers[CCR], self.registers[TRISE], self.registers[CR2] & FREQ
        for text in i2c_timing.problems(ccr, trise, freq, self.soc.clocks.pclk1_hz):
            self.note("forbidden", text)

    def _connected(self) -> bool:
        gpio = self.soc.gpio
        if self._connected_since == gpio.switched:
            return True
        missing = unconnected(gpio, self._pins)
        self._connected_since = -1 if missing else gpio.switched
        if missing:
            self.note("forbidden", f"no device can answer before the pins are switched: {missing}")
        return not missing

    # -- interrupts and DMA -----------------------------------------------------------------------------

    def _update(self) -> None:
        """Make the DMA requests that stand and set the interrupt lines."""
        if self._serving or not self._sequence.watched:
            return
        if self.registers[CR2] & DMAEN:
            self._serving = True
            self._serve_dma()
            self._serving = False
        self._lines()

    def _serve_dma(self) -> None:
        sequence, dma, line = self._sequence, self.soc.dma, f"{self.name}_RX"
        for _ in range(2):  # DR and the shift register
            if sequence.status1 & RXNE and dma.request(line):
                sequence.nack_next = bool(self.registers[CR2] & LAST) and dma.remaining(line) == 1
            if sequence.status1 & TXE:
                dma.request(f"{self.name}_TX")

    def _lines(self) -> None:
        cr2, status = self.registers[CR2], self._sequence.status1
        events = _EVENTS | (TXE | RXNE if cr2 & ITBUFEN else 0)
        self._event_irq.set(self.name, bool(cr2 & ITEVTEN and status & events))
        self._error_irq.set(self.name, bool(cr2 & ITERREN and status & _ERRORS))
