"""What an I2C block does on the wire as bus master, byte after byte (RM0368 section 18.3.3, figures 163,
164).

A sequence of operations: start, address, data bytes, stop. Between two of them the block looks at what
software asks for (STOP, START, DR) and either goes on or holds SCL low. Each operation ends at a known time.
What it does then (a flag, a byte to a sensor) is a deferred call of the clock, which needs no event: it is
carried out at its own time when somebody looks. While an interrupt or DMA waits for it, it is an event.

The receiver has two stages, DR and shift register: with both full (BTF) SCL is held until DR is read. ACK
decides at the end of a byte; with POS it decides one byte ahead, and the first byte's answer is what ACK was
when the address had been sent, which is how HAL reads two bytes. After a byte that was not acknowledged SCL
is held until STOP or START, so a late STOP costs no byte. On the chip that is sure only while DR is still
full.

A START clears what is left of TXE and BTF. STOP and START wait for the end of the byte in the shift register;
a byte still in DR then is lost, which is told: the manual wants STOP written while TXE or BTF is set.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from fractions import Fraction
from typing import Final

from emulator.arm.peripherals.i2c_registers import (
    ACK,
    ADDR,
    AF,
    ARLO,
    BERR,
    BTF,
    BUSY,
    MSL,
    POS,
    RXNE,
    SB,
    START,
    STOP,
    TRA,
    TXE,
)
from emulator.clock import NEVER_PS, Clock, Event
from emulator.i2c_wire import I2CWire

DATA_LOST: Final = "DR written while TXE was 0: the byte that waited there is lost"
STOP_EARLY: Final = "STOP or START while a byte waits in DR (TXE = 0): that byte is not sent"
"""What firmware did wrong."""


class _Phase(Enum):
    """What happens on the wire, or what the block waits for while it holds SCL low."""

    IDLE = auto()
    BUSY = auto()  # an operation is under way
    ADDRESS = auto()  # after a start: for the address in DR
    ADDRESSED = auto()  # for ADDR to be cleared
    SEND = auto()  # for a byte in DR, STOP or START
    FULL = auto()  # for DR to be read
    ENDED = auto()  # after a missing acknowledge, for STOP or START


_BETWEEN_BYTES = (_Phase.ADDRESS, _Phase.SEND, _Phase.FULL, _Phase.ENDED)


class Sequence:
    """The block's registers CR1, SR1, SR2 and DR, and what they make of the wire.

    ``connected()``: whether the pins are switched, asked before each address. ``changed()``: called after
    each operation while ``watched``. ``note(what, text)`` tells what firmware did wrong.
    """

    def __init__(
        self,
        clock: Clock,
        wire: I2CWire,
        connected: Callable[[], bool],
        changed: Callable[[], None],
        note: Callable[[str, str], None],
    ) -> None:
        self._clock = clock
        self._wire = wire
        self._connected = connected
        self._changed = changed
        self._note = note
        self.watched = False
        """Whether an interrupt or DMA waits for flags: operations end in events of the clock."""
        self.clocked = True
        """Set by RCC."""
        self.checked = False
        """Whether the clock's settings have been looked at since they have changed."""
        self._bit_ps: int = NEVER_PS  # one period of SCL, and the nine of a byte with its acknowledge
        self._byte_ps: int = NEVER_PS
        self._planned: Event | None = None
        self._clear()

    def _clear(self) -> None:
        self.control = 0  # CR1
        self.status1 = self.status2 = 0
        self.data = 0  # DR
        self.seen = 0  # SR1 as last read
        self.due_ps: int = NEVER_PS
        self.nack_next = False  # DMA has announced the last byte
        self._then: Callable[[], None] = self._go_on
        self._phase = _Phase.IDLE
        self._shift = 0
        self._waiting = False  # to be sent: DR holds a byte that the shift register has not taken yet
        self._shift_full = False  # received: DR was not free for it
        self._acknowledge = False  # with POS: the answer to the next byte
        self._start_ps = 0

    def reset(self) -> None:
        """No operation, no flag, the bus let go in the middle of whatever was under way."""
        if self._planned is not None:
            self._planned.cancel()
            self._planned = None
        self._wire.abort()
        self._clear()

    def set_period(self, period_ps: Fraction | None) -> None:
        """The period of SCL from the next operation on; None: it does not run, and no operation ever ends."""
        self._bit_ps = NEVER_PS if period_ps is None else int(period_ps)
        self._byte_ps = NEVER_PS if period_ps is None else int(9 * period_ps)

    def settle(self) -> None:
        """Carry out what has become due by now."""
        if self._clock.deferred_ps <= self._clock.now_ps:
            self._clock.settle()

    # -- what software does -----------------------------------------------------------------------------

    def request(self, control: int) -> None:
        """CR1 was written: START and STOP are obeyed when no byte is under way."""
        self.control = control
        self._go_on()

    def clear_addr(self) -> None:
        """ADDR is cleared: the data phase begins."""
        self.status1 &= ~ADDR
        if not self.status2 & TRA:
            self._begin(self._byte_ps, self._received)
            return
        self._phase = _Phase.SEND
        if self._waiting:
            self._send()
        else:
            self.status1 |= TXE
            self._stop_or_start()

    def write_data(self, value: int) -> None:
        """DR was written: an address after SB, or a byte to be sent."""
        if self._phase is _Phase.ADDRESS:
            self.status1 &= ~SB
            self._shift = value
            self._begin(self._byte_ps, self._address_sent)
        elif self.status2 & TRA:
            if self._waiting:
                self._note("forbidden", DATA_LOST)
            self.status1 &= ~BTF
            self.data = value
            if self._phase is _Phase.SEND:
                self._send()
            else:
                self._waiting = True
                self.status1 &= ~TXE

    def read_data(self) -> int:
        """DR was read: the shift register moves up, and SCL goes on if it was held."""
        value = self.data
        if self._shift_full:
            self.data, self._shift_full = self._shift, False
            self.status1 &= ~BTF
            if self._phase is _Phase.FULL:
                self._begin(self._byte_ps, self._received)
        else:
            self.status1 &= ~RXNE
        return value

    def plan_again(self) -> None:
        """``watched`` has changed: the operation under way ends in the other way."""
        if self._planned is not None:
            self._planned.cancel()
            self._plan(self.due_ps, self._then)

    # -- operations -------------------------------------------------------------------------------------

    def _begin(self, duration_ps: int, then: Callable[[], None]) -> None:
        """An operation begins; ``then()`` is called at its end."""
        self._phase = _Phase.BUSY
        if duration_ps < NEVER_PS:
            self._plan(self._clock.now_ps + duration_ps, then)

    def _plan(self, at_ps: int, then: Callable[[], None]) -> None:
        self.due_ps, self._then = at_ps, then
        put = self._clock.schedule if self.watched else self._clock.defer
        self._planned = put(at_ps, self._ended)

    def _ended(self) -> None:
        self._planned, self.due_ps = None, NEVER_PS
        self._then()
        if self.watched:
            self._changed()

    def _go_on(self) -> None:
        if self._phase is _Phase.IDLE:
            self.control &= ~STOP
            if self.control & START:
                self._start_when_free()
        elif self._phase in _BETWEEN_BYTES:
            self._stop_or_start()

    def _stop_or_start(self) -> bool:
        """Obey STOP or START between two bytes; False if neither is asked for."""
        if not self.control & (START | STOP):
            return False
        if self._waiting and not self.status1 & AF:
            self._note("forbidden", STOP_EARLY)
        if self.control & STOP:
            self._begin(self._bit_ps, self._stopped)
        else:
            self._start()
        return True

    def _start_when_free(self) -> None:
        if self._wire.held():
            self._phase = _Phase.BUSY
            self._plan(self._wire.released_ps(), self._released)
        else:
            self._start()

    def _released(self) -> None:
        self._phase = _Phase.IDLE
        self._go_on()

    def _start(self) -> None:
        self._start_ps = self._clock.now_ps
        self.status2 |= BUSY
        self._begin(self._bit_ps, self._started)

    def _started(self) -> None:
        self.control &= ~START
        self._end_of_sending()
        self.status1 |= SB
        self.status2 = MSL | BUSY
        self._phase = _Phase.ADDRESS

    def _stopped(self) -> None:
        self._wire.stop()
        self.control &= ~STOP
        self._end_of_sending()
        self.status1 &= ~SB
        self.status2 = 0
        self._phase = _Phase.IDLE
        self._go_on()

    def _end_of_sending(self) -> None:
        """A start or stop condition leaves nothing of a transmission; received bytes stay."""
        if self.status2 & TRA:
            self.status1 &= ~(TXE | BTF)
        self._waiting = False

    def _address_sent(self) -> None:
        read = self._shift & 1
        answer = "nack"
        if self._connected():
            answer = self._wire.start(self._shift >> 1, read=bool(read), start_ps=self._start_ps)
        if answer == "ack":
            self.status1 |= ADDR
            self.status2 |= 0 if read else TRA
            self._acknowledge = bool(self.control & ACK)
            self._phase = _Phase.ADDRESSED
        elif answer == "arbitration":
            self._wire.abort()
            self.status1 |= ARLO
            self.status2 = 0
            self._phase = _Phase.IDLE
        else:
            self._failed(BERR if answer == "bus_error" else AF)

    def _failed(self, flag: int) -> None:
        self.status1 |= flag
        self._phase = _Phase.ENDED
        self._stop_or_start()

    def _send(self) -> None:
        self._shift, self._waiting = self.data, False
        self.status1 |= TXE
        self._begin(self._byte_ps, self._sent)

    def _sent(self) -> None:
        if not self._wire.write_byte(self._shift):
            self._failed(AF)
        elif self._stop_or_start():
            return
        elif self._waiting:
            self._send()
        else:
            self.status1 |= BTF
            self._phase = _Phase.SEND

    def _received(self) -> None:
        value = self._wire.read_byte()
        acknowledged = self._answer()
        if self.status1 & RXNE:
            self._shift, self._shift_full = value, True
            self.status1 |= BTF
        else:
            self.data = value
            self.status1 |= RXNE
        if self._stop_or_start():
            return
        if not acknowledged:
            self._phase = _Phase.ENDED
        elif self._shift_full:
            self._phase = _Phase.FULL
        else:
            self._begin(self._byte_ps, self._received)

    def _answer(self) -> bool:
        """Whether the byte just received is acknowledged (ACK, POS, and LAST with DMA)."""
        now = bool(self.control & ACK)
        answer = self._acknowledge if self.control & POS else now
        self._acknowledge = now
        if self.nack_next:
            self.nack_next = False
            return False
        return answer
