"""SPI1 to SPI3 as master (RM0368 sections 20.3, 20.5).

A byte takes eight periods of SCK from its start; its end is a deferred call of the clock, at which the line
(:class:`emulator.spi_wire.SpiLine`) exchanges it. With an interrupt or DMA enabled the end is an event.

Directions: full duplex; one line out (BIDIMODE, BIDIOE); one line in (BIDIMODE), and receive-only (RXONLY).
In the last two the clock is started by SPE, not by DR, and BSY stays low in the third (20.3.7).

Decision: in the receive directions a byte starts when SPE is set, and each further one when DR is read while
SPE is still set. A byte in flight when SPE is cleared is completed. So a pulse of SPE gives exactly one byte,
as ST's sensor driver wants it (67 DSB instructions between bit 1 and bit 8), however many cycles an
instruction is charged. The chip clocks on without waiting for DR, and a pulse that is too long overruns: that
trap is not shown here, where instruction timing is an estimate.

Not modelled, and told when used: slave mode, CRC, TI mode, I2S, the NSS pin. A master whose internal NSS is
low (SSM = 1, SSI = 0) gets MODF.
"""

from __future__ import annotations

from typing import ClassVar, get_args

from emulator.arm.peripherals.irq_line import IrqLine
from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.peripherals.pins import PinFunction, unconnected
from emulator.arm.soc import Soc
from emulator.clock import NEVER_PS, PS_PER_S, Event
from emulator.spi_wire import SpiLine
from sensors.spi import UNDRIVEN, Mode

CR1, CR2, SR, DR = 0x00, 0x04, 0x08, 0x0C
CRCPR, RXCRCR, TXCRCR, I2SCFGR, I2SPR = 0x10, 0x14, 0x18, 0x1C, 0x20

MSTR, SPE, LSBFIRST, SSI, SSM, RXONLY = 1 << 2, 1 << 6, 1 << 7, 1 << 8, 1 << 9, 1 << 10
DFF, BIDIOE, BIDIMODE = 1 << 11, 1 << 14, 1 << 15
RXDMAEN, TXDMAEN, SSOE, ERRIE, RXNEIE, TXEIE = 1 << 0, 1 << 1, 1 << 2, 1 << 5, 1 << 6, 1 << 7
RXNE, TXE, MODF, OVR, BSY = 1 << 0, 1 << 1, 1 << 5, 1 << 6, 1 << 7

_CLOCKING = 0x3B  # BR, CPOL, CPHA
_WATCHED = RXDMAEN | TXDMAEN | ERRIE | RXNEIE | TXEIE
_ON = SPE | MSTR
_NOT_MODELLED = {
    CR1: {1 << 13: "CRCEN (CRC calculation)"},
    CR2: {1 << 4: "FRF (TI mode)"},
    I2SCFGR: {1 << 11: "I2SMOD (I2S mode)"},
}
_INTERRUPT = {"SPI1": 35, "SPI2": 36, "SPI3": 51}  # RM0368 table 38
_MODES: tuple[Mode, ...] = get_args(Mode)


class Spi(Peripheral):
    """``name`` is "SPI1" to "SPI3"; ``line`` is what its pins lead to, None if nothing.

    ``pins``: those that must be switched to it, or else nobody hears it.
    """

    REGISTERS: ClassVar[dict[int, int]] = {
        **dict.fromkeys((CR1, CR2, DR, RXCRCR, TXCRCR, I2SCFGR), 0),
        SR: TXE,
        CRCPR: 7,
        I2SPR: 2,
    }
    NAMES: ClassVar[dict[int, str]] = {
        CR1: "CR1",
        CR2: "CR2",
        SR: "SR",
        DR: "DR",
        CRCPR: "CRCPR",
        RXCRCR: "RXCRCR",
        TXCRCR: "TXCRCR",
        I2SCFGR: "I2SCFGR",
        I2SPR: "I2SPR",
    }
    WRITABLE: ClassVar[dict[int, int]] = {
        CR1: 0xFFFF,
        CR2: 0xF7,
        CRCPR: 0xFFFF,
        RXCRCR: 0,
        TXCRCR: 0,
        I2SCFGR: 0xFBF,
        I2SPR: 0x3FF,
    }

    def __init__(
        self,
        soc: Soc,
        name: str,
        base: int,
        line: SpiLine | None,
        pins: tuple[PinFunction, ...] = (),
        size: int = 0x400,
    ) -> None:
        super().__init__(soc, name, base, size)
        self._clock = soc.clock
        self._line = line
        self._pins = pins
        self._irq = IrqLine(soc, _INTERRUPT[name])
        self._kernel_clock = "pclk2_hz" if name == "SPI1" else "pclk1_hz"
        self._planned: Event | None = None
        self._clear()
        soc.clocks.on_change(self._set_clock)
        for direction in ("TX", "RX"):
            soc.dma.connect(f"{name}_{direction}", self._update)

    def _clear(self) -> None:
        if self._planned is not None:
            self._planned.cancel()
        self._planned = None
        self._due_ps: int = NEVER_PS
        self._sr = TXE
        self._shift: int | None = 0  # the frame under way: what is sent, None in a receive direction
        self._busy = False
        self._to_send = 0  # DR's transmit buffer, full while TXE is 0
        self._received = 0  # and its receive buffer
        self._data_read = False  # DR was read since OVR: a read of SR clears it
        self._modf_seen = False
        self._serving = False
        self._watched = False
        self._byte_ps: int = 0
        self._clocked_as = -1  # the bits of CR1 that the line was last set up for
        self._connected = True

    def reset(self) -> None:
        """All registers; a frame under way is lost."""
        super().reset()
        self._clear()
        self._update()

    # -- access -----------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """DR takes a frame; SR after DR clears OVR."""
        if self._clock.deferred_ps <= self._clock.now_ps:
            self._clock.settle()
        if offset == SR:
            status = self._sr
            if status & (OVR | MODF):
                self._status_read(status)
            return status
        return self._read_data() if offset == DR else self.registers.get(offset, 0)

    def look(self, offset: int) -> tuple[int, int]:
        """SR without error flags is what polling loops read."""
        if self._clock.deferred_ps <= self._clock.now_ps:
            self._clock.settle()
        if offset != SR or self._sr & (OVR | MODF):
            return super().look(offset)
        return self._sr, self._due_ps

    def peek(self, offset: int) -> int:
        """The same without taking or clearing anything."""
        if offset == SR:
            return self._sr
        return self._received if offset == DR else self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """DR sends a frame, CR1 starts the receive directions, the others configure."""
        self._clock.settle()
        if offset == DR:
            self._write_data(value & (0xFFFF if self.registers[CR1] & DFF else 0xFF))
        elif offset != SR:
            old = self.registers.get(offset, 0)
            super().write(offset, value, mask)
            self._configured(offset, old)
        if self._watched:
            self._update()

    def pure_read(self, offset: int) -> bool:
        """Polling SR may be skipped while it has no error flag to clear."""
        return offset != DR and not (offset == SR and self._sr & (OVR | MODF))

    def next_change_ps(self) -> int:
        """The end of the frame under way."""
        return self._due_ps

    def _status_read(self, status: int) -> None:
        if self._data_read:
            self._sr &= ~OVR
        self._modf_seen = bool(status & MODF)
        if self._watched:
            self._update()

    # -- settings ---------------------------------------------------------------------------------------

    def _configured(self, offset: int, old: int) -> None:
        new = self.registers.get(offset, 0)
        for bit, text in _NOT_MODELLED.get(offset, {}).items():
            if new & bit:
                self.note("not modelled", text)
        if offset == CR1:
            self._control(new, old)
        elif offset == CR2:
            self._watched = bool(new & _WATCHED)
            if self._busy:
                self._plan(self._due_ps)
            self._update()

    def _control(self, new: int, old: int) -> None:
        if self._modf_seen:
            self._sr &= ~MODF
            self._modf_seen = False
        if new & MSTR and new & SSM and not new & SSI:
            self._sr |= MODF
            new = self.registers[CR1] = new & ~(SPE | MSTR)
            self.note("forbidden", "master with SSM = 1 and SSI = 0: mode fault (MODF), SPE and MSTR cleared")
        if new & SPE and new & _CLOCKING != self._clocked_as:
            self._set_clock()
        if new & SPE and not old & SPE:
            self._switched_on(new)
        if new & SPE and not self._busy:
            self._next(began=not old & SPE or not self._receiving(old))

    def _switched_on(self, control: int) -> None:
        if not control & MSTR:
            self.note("not modelled", "slave mode: SPE set with MSTR = 0, and no other master on this board")
        elif not control & SSM and not self.registers[CR2] & SSOE:
            self.note("not modelled", "NSS as input (SSM = 0, SSOE = 0); it is taken as high")
        missing = unconnected(self.soc.gpio, self._pins)
        self._connected = not missing
        if missing:
            self.note("forbidden", f"no part can answer before the pins are switched: {missing}")

    def _set_clock(self) -> None:
        """SCK from BR, mode from CPOL and CPHA (20.5.1)."""
        control = self.registers[CR1]
        self._clocked_as = control & _CLOCKING if control & SPE else -1
        divider = 2 << (control >> 3 & 7)
        kernel_hz: int = getattr(self.soc.clocks, self._kernel_clock)
        self._byte_ps = 8 * divider * PS_PER_S // kernel_hz
        if self._line is None or not control & SPE:
            return
        speed_hz = kernel_hz // divider
        self._line.configure(speed_hz, _MODES[control & 3])

    # -- frames -----------------------------------------------------------------------------------------

    def _receiving(self, control: int) -> bool:
        """Whether the clock is started by SPE instead of DR."""
        return bool(not control & BIDIOE if control & BIDIMODE else control & RXONLY)

    def _next(self, *, began: bool) -> None:
        """Between two frames: start another one if there is a reason to."""
        control = self.registers[CR1]
        if control & _ON != _ON:
            return
        if self._receiving(control):
            if began:
                self._start(None)
        elif not self._sr & TXE:
            self._sr |= TXE
            self._start(self._to_send)

    def _start(self, value: int | None) -> None:
        control = self.registers[CR1]
        self._shift = value
        self._busy = True
        if value is not None or not control & BIDIMODE:
            self._sr |= BSY
        self._plan(self._clock.now_ps + self._byte_ps * (2 if control & DFF else 1))

    def _plan(self, at_ps: int) -> None:
        if self._planned is not None:
            self._planned.cancel()
        self._due_ps = at_ps
        put = self._clock.schedule if self._watched else self._clock.defer
        self._planned = put(at_ps, self._ended)

    def _ended(self) -> None:
        self._planned, self._due_ps, self._busy = None, NEVER_PS, False
        control = self.registers[CR1]
        value = self._transfer(control)
        self._sr &= ~BSY
        if value is not None:
            self._store(value)
        self._next(began=False)
        if self._watched:
            self._update()

    def _transfer(self, control: int) -> int | None:
        """The frame on the line, most significant byte first; None if nothing was listened to."""
        frame = 0
        sent = self._shift
        listens = sent is None or not control & BIDIMODE
        for shift in (8, 0) if control & DFF else (0,):
            out = None if sent is None else sent >> shift & 0xFF
            frame = frame << 8 | self._byte(control, out)
        return frame if listens else None

    def _byte(self, control: int, out: int | None) -> int:
        line = self._line if self._connected else None
        if line is None:
            return UNDRIVEN
        if out is not None and control & LSBFIRST:
            out = _reversed(out)
        if not control & BIDIMODE:
            answer = line.exchange(UNDRIVEN if out is None else out)
        elif out is None:
            answer = line.receive()
        else:
            line.send(out)
            return UNDRIVEN
        return _reversed(answer) if control & LSBFIRST else answer

    def _store(self, value: int) -> None:
        if self._sr & RXNE:
            self._sr |= OVR
            self._data_read = False
        else:
            self._received = value
            self._sr |= RXNE

    def _write_data(self, value: int) -> None:
        if not self._sr & TXE:
            self.note("forbidden", "DR written while TXE was 0: the frame that waited there is lost")
        self._to_send = value
        self._sr &= ~TXE
        if not self._busy:
            self._next(began=False)

    def _read_data(self) -> int:
        self._sr &= ~RXNE
        self._data_read = True
        if not self._busy and self._receiving(self.registers[CR1]):
            self._next(began=True)
        if self._watched:
            self._update()
        return self._received

    # -- interrupts and DMA -----------------------------------------------------------------------------

    def _update(self) -> None:
        """Make the DMA requests that stand and set the interrupt line."""
        if self._serving:
            return
        self._serving = True
        self._serve_dma()
        self._serving = False
        enabled, status = self.registers[CR2], self._sr
        causes = (TXE if enabled & TXEIE else 0) | (RXNE if enabled & RXNEIE else 0)
        self._irq.set(self.name, bool(status & (causes | (OVR | MODF if enabled & ERRIE else 0))))

    def _serve_dma(self) -> None:
        enabled, dma = self.registers[CR2], self.soc.dma
        if enabled & RXDMAEN and self._sr & RXNE:
            dma.request(f"{self.name}_RX")
        for _ in range(2):  # the shift register and DR
            if enabled & TXDMAEN and self._sr & TXE:
                dma.request(f"{self.name}_TX")


def _reversed(value: int) -> int:
    """A byte's bits in the other order, for LSBFIRST."""
    return int(f"{value:08b}"[::-1], 2)
