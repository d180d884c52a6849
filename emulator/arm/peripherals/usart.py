"""USART1, USART2 and USART6 in asynchronous mode (RM0368 section 19).

The line and its two registers are :class:`emulator.uart.Uart`; here are the flags, interrupts and DMA
requests around them. TXE and TC are computed from the time when SR is read; an event is scheduled only while
an interrupt or a DMA request waits for one of them.

As on the chip (19.3, 19.6.1): TC is cleared by a read of SR followed by a write of DR, or by writing 0 to it;
ORE and IDLE by a read of SR that shows them followed by a read of DR. A byte written before the transmitter
is enabled waits in DR.

Not modelled, and told when switched on: synchronous, smartcard, IrDA, LIN and half-duplex mode, hardware flow
control, mute mode and break. Parity and 9-bit frames have their length on the wire, but bits 0 to 7 are what
is carried. The idle frame that setting TE sends first is left out: it would delay the first byte only if that
is written within one frame after TE. What RM0368 leaves open: clearing TE lets the frames in flight finish.
"""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

from emulator.arm.peripherals.irq_line import IrqLine
from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.peripherals.pins import PinFunction, unconnected
from emulator.arm.soc import Soc
from emulator.clock import NEVER_PS, PS_PER_S, Event
from emulator.uart import BAUD, Uart

SR, DR, BRR, CR1, CR2, CR3, GTPR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18

ORE, IDLE, RXNE, TC, TXE = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
RE, TE, IDLEIE, RXNEIE, TCIE, TXEIE = 1 << 2, 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
PCE, M, UE, OVER8 = 1 << 10, 1 << 12, 1 << 13, 1 << 15
EIE, DMAR, DMAT = 1 << 0, 1 << 6, 1 << 7

_SENDING = UE | TE
_WATCHED_CR1 = IDLEIE | RXNEIE | TCIE | TXEIE
_WATCHED_CR3 = EIE | DMAR | DMAT
_STOP_HALF_BITS = (2, 1, 4, 3)  # CR2.STOP
_NOT_MODELLED = {
    CR1: {1 << 0: "SBK (break)", 1 << 1: "RWU (mute mode)"},
    CR2: {1 << 11: "CLKEN (synchronous mode)", 1 << 14: "LINEN (LIN mode)"},
    CR3: {
        1 << 1: "IREN (IrDA mode)",
        1 << 3: "HDSEL (half duplex)",
        1 << 5: "SCEN (smartcard mode)",
        1 << 8: "RTSE (flow control)",
        1 << 9: "CTSE (flow control)",
    },
}
_INTERRUPT = {"USART1": 37, "USART2": 38, "USART6": 71}  # RM0368 table 38
_FURTHEST_OFF = 0.03  # a receiver that samples the middle of ten bits bears this much (19.3.5)


class Usart(Peripheral):
    """``name`` is "USART1", "USART2" or "USART6"; ``uart`` is its line, set up by the registers from now on.

    ``tx_pin``: where the terminal is connected; a USART that it is not switched to is heard by nobody.
    ``terminal_baud``: another rate is told in the trace; None where no terminal is connected.
    """

    REGISTERS: ClassVar[dict[int, int]] = {SR: TXE | TC, DR: 0, BRR: 0, CR1: 0, CR2: 0, CR3: 0, GTPR: 0}
    NAMES: ClassVar[dict[int, str]] = {
        SR: "SR",
        DR: "DR",
        BRR: "BRR",
        CR1: "CR1",
        CR2: "CR2",
        CR3: "CR3",
        GTPR: "GTPR",
    }
    WRITABLE: ClassVar[dict[int, int]] = {BRR: 0xFFFF, CR1: 0xBFFF, CR2: 0x7F6F, CR3: 0x0FFF, GTPR: 0xFFFF}

    def __init__(
        self,
        soc: Soc,
        name: str,
        base: int,
        uart: Uart,
        tx_pin: PinFunction | None = None,
        terminal_baud: int | None = BAUD,
        size: int = 0x400,
    ) -> None:
        super().__init__(soc, name, base, size)
        self._uart = uart
        self._clock = soc.clock
        self._tx_pins = (tx_pin,) if tx_pin else ()
        self._terminal_baud = terminal_baud
        self._irq = IrqLine(soc, _INTERRUPT[name])
        self._kernel_clock = "pclk1_hz" if name == "USART2" else "pclk2_hz"  # RM0368 figure 12
        self._event: Event | None = None
        self._event_ps = NEVER_PS
        self._serving = False
        uart.on_receive = self._update
        soc.clocks.on_change(self._set_frame)
        for direction in ("TX", "RX"):
            soc.dma.connect(f"{name}_{direction}", self._update)
        self._clear()

    def reset(self) -> None:
        """Registers, flags and a byte received; frames on the wire are finished."""
        super().reset()
        self._clear()
        self._update()

    def _clear(self) -> None:
        self._seen = 0  # SR as last read: what a following read of DR clears
        self._armed = False  # SR was read since DR was last written: writing DR clears TC
        self._tc_ps: int = 0  # when TC is next set
        self._waiting: int | None = None  # a byte in DR while the transmitter is off
        self._received = 0
        self._watched = False  # whether an interrupt or a DMA request may be due
        self._uart.receiver_on = False
        self._uart.read_data()
        self._uart.overrun = self._uart.rx_idle = False

    # -- access -----------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """SR begins the sequences that clear flags; DR takes the received byte."""
        if offset == SR:
            self._seen = status = self._status()
            self._armed = True
            return status
        if offset == DR:
            return self._read_data()
        return self.registers.get(offset, 0)

    def peek(self, offset: int) -> int:
        """The same without clearing or taking anything."""
        if offset == SR:
            return self._status()
        return self._received if offset == DR else self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """DR sends a byte; SR clears TC and RXNE where 0 is written; the others configure."""
        if offset == DR:
            self._write_data(value & 0xFF)
        elif offset == SR:
            self._clear_flags(value | ~mask)
        else:
            super().write(offset, value, mask)
            self._configured(offset)
        if self._watched:
            self._update()

    def pure_read(self, offset: int) -> bool:
        """Polling SR may be skipped: reading it again changes nothing more."""
        return offset != DR

    def next_change_ps(self) -> int:
        """When TXE or TC comes next; the receiver's flags come with events."""
        now_ps = self._clock.now_ps
        return min((at for at in (self._uart.txe_ps, self._tc_ps) if at > now_ps), default=NEVER_PS)

    def _status(self) -> int:
        uart, now_ps = self._uart, self._clock.now_ps
        status = TC if now_ps >= self._tc_ps else 0
        if now_ps >= uart.txe_ps and self._waiting is None:
            status |= TXE
        if uart.rxne:
            status |= RXNE
        if uart.overrun:
            status |= ORE
        return status | IDLE if uart.rx_idle else status

    # -- data -------------------------------------------------------------------------------------------

    def _write_data(self, value: int) -> None:
        if self.registers[CR1] & _SENDING == _SENDING:
            self._send(value)
        else:
            self._waiting = value
            self._tc_ps = NEVER_PS
            self.note("forbidden", "DR written while UE or TE in CR1 is 0: the byte waits until both are set")

    def _send(self, value: int) -> None:
        uart = self._uart
        uart.connected = self._connected()
        stays_set = self._clock.now_ps >= self._tc_ps and not self._armed
        if not uart.send(value):
            self.note("forbidden", "DR written while TXE was 0: the byte that waited there is lost")
        if not stays_set:
            self._tc_ps = uart.idle_ps
        self._armed = False

    def _connected(self) -> bool:
        missing = unconnected(self.soc.gpio, self._tx_pins)
        if missing:
            self.note("forbidden", f"a byte is sent, but nothing leaves the chip: switch {missing}")
        return not missing

    def _read_data(self) -> int:
        uart = self._uart
        value = uart.read_data()
        if value is not None:
            self._received = value
        if self._seen & ORE:
            uart.overrun = False
        if self._seen & IDLE:
            uart.rx_idle = False
        self._seen = 0
        if self._watched:
            self._update()
        return self._received

    def _clear_flags(self, kept: int) -> None:
        """TC and RXNE are cleared by writing 0 (rc_w0)."""
        if not kept & TC and self._clock.now_ps >= self._tc_ps:
            busy = self._clock.now_ps < self._uart.idle_ps
            self._tc_ps = self._uart.idle_ps if busy else NEVER_PS
        if not kept & RXNE:
            self._uart.read_data()

    # -- settings ---------------------------------------------------------------------------------------

    def _configured(self, offset: int) -> None:
        for bit, name in _NOT_MODELLED.get(offset, {}).items():
            if self.registers[offset] & bit:
                self.note("not modelled", name)
        cr1, cr3 = self.registers[CR1], self.registers[CR3]
        self._watched = bool(cr1 & _WATCHED_CR1 or cr3 & _WATCHED_CR3)
        self._uart.receiver_on = cr1 & (UE | RE) == UE | RE
        self._set_frame()
        if self._waiting is not None and cr1 & _SENDING == _SENDING:
            value, self._waiting, self._tc_ps = self._waiting, None, NEVER_PS
            self._send(value)
        self._update()

    def _set_frame(self) -> None:
        """The length of a frame from BRR, OVER8, M and STOP (19.3.4)."""
        cr1 = self.registers[CR1]
        ticks = self._ticks_per_bit()
        kernel_hz: int = getattr(self.soc.clocks, self._kernel_clock)
        half_bits = 2 * (10 if cr1 & M else 9) + _STOP_HALF_BITS[self.registers[CR2] >> 12 & 3]
        if ticks == 0:
            self._uart.set_frame(Fraction(NEVER_PS))  # no bit clock: nothing ever leaves
            return
        self._uart.set_frame(Fraction(half_bits * ticks * PS_PER_S, 2 * kernel_hz))
        if cr1 & _SENDING == _SENDING:
            self._check_against_terminal(kernel_hz / ticks, plain=half_bits == 20 and not cr1 & PCE)

    def _ticks_per_bit(self) -> int:
        brr = self.registers[BRR]
        return (brr >> 4) * 8 + (brr & 7) if self.registers[CR1] & OVER8 else brr

    def _check_against_terminal(self, baud: float, *, plain: bool) -> None:
        expected = self._terminal_baud
        if expected is None:
            return
        if abs(baud / expected - 1) > _FURTHEST_OFF:
            text = f"{baud:.0f} baud; a terminal at {expected} baud would show garbage"
            self.note("forbidden", text)
        if not plain:
            self.note("forbidden", "frames are not 8N1; a terminal set to 8N1 would show garbage")

    # -- interrupts and DMA -----------------------------------------------------------------------------

    def _update(self) -> None:
        """Make the requests that stand, set the interrupt line, and plan when to look again."""
        if self._serving:
            return
        self._serving = True
        self._serve_dma()
        self._serving = False
        self._irq.set(self.name, self._interrupt())
        self._plan()

    def _serve_dma(self) -> None:
        cr3, dma = self.registers[CR3], self.soc.dma
        if cr3 & DMAR and self._uart.rxne:
            dma.request(f"{self.name}_RX")
        if cr3 & DMAT and self.registers[CR1] & _SENDING == _SENDING:
            for _ in range(2):  # the shift register and DR
                if self._status() & TXE:
                    dma.request(f"{self.name}_TX")

    def _interrupt(self) -> bool:
        """RM0368 19.4: flags and their enable bits have the same places, except the receiver's errors."""
        cr1, status = self.registers[CR1], self._status()
        if status & cr1 & (TXE | TC | RXNE | IDLE):
            return True
        return bool(status & ORE and (cr1 & RXNEIE or self.registers[CR3] & (EIE | DMAR) == EIE | DMAR))

    def _plan(self) -> None:
        now_ps, at_ps = self._clock.now_ps, NEVER_PS
        if (self.registers[CR1] & TXEIE or self.registers[CR3] & DMAT) and self._uart.txe_ps > now_ps:
            at_ps = self._uart.txe_ps
        if self.registers[CR1] & TCIE and self._tc_ps > now_ps:
            at_ps = min(at_ps, self._tc_ps)
        if at_ps == self._event_ps:
            return
        if self._event is not None:
            self._event.cancel()
        self._event = self._clock.schedule(at_ps, self._due) if at_ps < NEVER_PS else None
        self._event_ps = at_ps

    def _due(self) -> None:
        self._event, self._event_ps = None, NEVER_PS
        self._update()
