"""The timers: registers, update and compare flags, interrupts, capture (RM0368 sections 12 to 14).

Everything is computed from the time when it is looked at; :mod:`tim_timebase` says how.

Decision: an event of the clock exists only while an enabled interrupt or DMA request waits for its flag. A
timer that merely runs (PWM, time base of a capture) costs nothing, and one whose handler is too slow costs
no more than its handler: the updates it misses are counted when the flag is cleared.

Not modelled, and told where firmware asks for it: slave modes, external clocks and encoders (SMCR), DMA on
compare and DMA bursts. Not modelled and silent: break input and dead time, outputs as levels on pins (their
duty is :meth:`Timer.pwm`). A compare flag is raised when the counter arrives at the value, not when CNT or
CCR is written to be equal. A timer whose clock is gated off while it counts goes on counting.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import ClassVar

from emulator.arm.peripherals.irq_line import IrqLine
from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.peripherals.tim_channels import Channel, Pwm
from emulator.arm.peripherals.tim_counter import Mode
from emulator.arm.peripherals.tim_registers import (
    ARR,
    BDTR,
    CCER,
    CCMR1,
    CCMR2,
    CCR1,
    CCR4,
    CNT,
    CR1,
    DCR,
    DIER,
    DMAR,
    EGR,
    NAMES,
    PSC,
    RCR,
    SMCR,
    SR,
    masks,
)
from emulator.arm.peripherals.tim_ticks import TickAccount
from emulator.arm.peripherals.tim_timebase import TimeBase
from emulator.arm.peripherals.tim_variants import Variant
from emulator.arm.soc import Soc
from emulator.clock import NEVER_PS, Event

_CEN, _UDIS, _URS, _OPM, _DIR, _ARPE = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 4, 1 << 7
_UIF = _UIE = _UG = 1 << 0
_UDE, _CCDE, _MOE = 1 << 8, 0x1E00, 1 << 15
_COM_TRIGGER_BREAK, _COMPARE_FLAGS = 0xE0, 0x1E


class Timer(Peripheral):
    """One timer. Its account of update interrupts reads like :class:`emulator.timer.IntervalTimer`'s."""

    NAMES: ClassVar[dict[int, str]] = NAMES

    def __init__(self, soc: Soc, variant: Variant, irqs: Mapping[int, IrqLine]) -> None:
        super().__init__(soc, variant.name, variant.base)
        self.account = TickAccount(variant.name, soc.trace)
        self._variant = variant
        self._irqs = [(flags, irqs[number]) for flags, number in variant.irqs]
        self._masks = masks(variant)
        self._changed = {
            CR1: self._cr1_changed,
            SMCR: self._smcr_changed,
            DIER: self._dier_changed,
            PSC: _nothing,  # always waits for an update (12.4.11)
            ARR: self._cr1_changed,
            **dict.fromkeys((CCMR1, CCMR2, CCER), self._channels_changed),
            **dict.fromkeys(range(CCR1, CCR1 + 4 * variant.channels, 4), self._channels_changed),
        }
        self._event: Event | None = None
        self._event_ps: int = NEVER_PS
        self._clear()
        soc.clocks.on_change(self._clock_changed)
        for number, pins in enumerate(variant.pins, start=1):
            for port, pin in pins:
                soc.gpio.listen(port, pin, partial(self._pin_changed, number, port, pin))

    def _clear(self) -> None:
        variant = self._variant
        self.registers = dict.fromkeys(self._masks, 0) | {ARR: (1 << variant.bits) - 1}
        self._time = TimeBase(variant.bits, self._input_hz(), self._raise_compare_flags, self._updated)
        self._channels = [Channel(number) for number in range(1, variant.channels + 1)]
        self._next_ps: int = NEVER_PS
        self._loaded = False  # whether the active registers are what is preloaded
        self._channels_changed()

    def reset(self) -> None:
        """Stopped, nothing enabled. The account of ticks goes on."""
        self._clear()
        self.account.forget()
        self._settle()

    # -- what the run's summary reads -------------------------------------------------------------------

    @property
    def ticks(self) -> int:
        """Updates while the update interrupt was enabled."""
        return self.account.ticks

    @property
    def late(self) -> int:
        """Ticks whose handler came late."""
        return self.account.late

    @property
    def lost(self) -> int:
        """Ticks that found the flag of the one before still set."""
        return self.account.lost

    @property
    def longest_wait_ps(self) -> int:
        """The longest time a tick waited for its handler, of those that were late."""
        return self.account.longest_wait_ps

    @property
    def rate_hz(self) -> float:
        """Update rate as configured; 0 while ARR is 0."""
        time = self._time
        if time.counter.blocked:
            return 0.0
        return time.hz / (time.prescale * time.counter.event_spacing * (time.repetition + 1))

    def pwm(self, channel: int) -> Pwm | None:
        """What channel 1 to 4 puts out; None while it puts out no PWM or the timer stands (RM0368 12.3.9).

        TIM1 needs BDTR.MOE too. Raises IndexError for a channel the timer does not have.
        """
        self._sync()
        time = self._time
        duty = self._channels[channel - 1].duty(time.counter)
        off = self._variant.advanced and not self.registers[BDTR] & _MOE
        if duty is None or off or not time.running or time.counter.blocked:
            return None
        halves = 2 if time.counter.mode is Mode.CENTRE else 1
        return Pwm(time.hz / (time.prescale * time.counter.event_spacing * halves), duty)

    # -- registers --------------------------------------------------------------------------------------

    def look(self, offset: int) -> tuple[int, int]:
        """SR and DIER at once: ST's HAL reads each of them eight times an interrupt."""
        if offset in {SR, DIER}:
            if self.soc.clock.now_ps >= self._next_ps:
                self._sync()
            return self.registers[offset], self._next_ps
        return super().look(offset)

    def read(self, offset: int) -> int:
        """A register as of now; reading CCRx takes a capture and clears its flag (12.4.5)."""
        value = self.peek(offset)
        if CCR1 <= offset <= CCR4 and offset in self.registers:
            channel = self._channels[(offset - CCR1) // 4]
            if channel.is_input and self.registers[SR] & channel.flag:
                self.registers[SR] &= ~channel.flag
                self._settle()
        return value

    def peek(self, offset: int) -> int:
        """A register as of now, without taking a capture."""
        self._sync()
        counter = self._time.counter
        if offset == CNT:
            return counter.value
        if offset == CR1 and counter.mode is Mode.CENTRE:
            return self.registers[CR1] & ~_DIR | _DIR * counter.falling
        return self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write the bits of ``mask`` of a register, as of now."""
        mask &= self._masks.get(offset, 0)
        if not mask:
            return
        self._time.catch_up(self.soc.clock.now_ps)
        value &= mask
        self._loaded &= offset == SR
        if offset == SR:
            self._clear_flags(~mask | value)
        elif offset == EGR:
            self._generate(value)
        elif offset == CNT:
            counter = self._time.counter
            counter.place(counter.value & ~mask | value, falling=counter.falling)
        else:
            self.registers[offset] = self.registers[offset] & ~mask | value
            self._changed.get(offset, _nothing)()
        if offset in {DCR, DMAR}:
            self.note("not modelled", f"{NAMES[offset]}: DMA bursts")
        self._settle()

    def pure_read(self, offset: int) -> bool:
        """False for the running counter, its direction, and captures, which reading takes."""
        if offset == CR1:
            return self._time.counter.mode is not Mode.CENTRE
        return offset != CNT and not CCR1 <= offset <= CCR4

    def next_change_ps(self) -> int:
        """When a flag of SR may next rise."""
        return self._next_ps

    # -- what a write changes ---------------------------------------------------------------------------

    def _cr1_changed(self) -> None:
        cr1 = self.registers[CR1]
        time = self._time
        centre = cr1 >> 5 & 3
        mode = Mode.CENTRE if centre else Mode.DOWN if cr1 & _DIR else Mode.UP
        time.counter.reshape(mode, time.counter.arr if cr1 & _ARPE else self.registers[ARR])
        self._place_channels()
        time.updates = not cr1 & _UDIS
        time.one_pulse = bool(cr1 & _OPM)
        if cr1 & _CEN:
            time.start(self.soc.clock.now_ps)
        else:
            time.stop(self.soc.clock.now_ps)

    def _smcr_changed(self) -> None:
        if self.registers[SMCR] & 0x4007:  # ECE, SMS
            self.note("not modelled", "SMCR: slave mode or external clock; the counter runs freely")

    def _dier_changed(self) -> None:
        dier = self.registers[DIER]
        if dier & _CCDE:
            self.note("not modelled", "DIER: DMA requests on capture and compare")
        if not dier & _UIE:
            self.account.forget()
        elif self.registers[SR] & _UIF and not self.account.waiting:
            self.account.due(self.soc.clock.now_ps)

    def _clear_flags(self, kept: int) -> None:
        self.registers[SR] &= kept
        if self.account.waiting and not self.registers[SR] & _UIF:
            self.account.acknowledged(self.soc.clock.now_ps)

    def _generate(self, events: int) -> None:
        """EGR: events by software (12.4.6)."""
        if events & _UG:
            if not self.registers[CR1] & _UDIS:
                self._load()
                if not self.registers[CR1] & _URS:
                    self._raise_update_flag(1)
            self._time.restart(self.soc.clock.now_ps)
        for channel in self._channels:
            if events & channel.flag:
                if channel.is_input:
                    self._capture(channel)
                else:
                    self.registers[SR] |= channel.flag
        self.registers[SR] |= events & _COM_TRIGGER_BREAK & self._masks[SR]

    def _channels_changed(self) -> None:
        for index, channel in enumerate(self._channels):
            channel.settings = self.registers[CCMR1 if index < 2 else CCMR2] >> 8 * (index % 2) & 0xFF
            channel.enable = self.registers[CCER] >> 4 * index & 0xF
            if not channel.preloaded:
                channel.compare = self.registers[CCR1 + 4 * index]
        self._place_channels()

    def _place_channels(self) -> None:
        centre_mode = self.registers[CR1] >> 5 & 3
        for channel in self._channels:
            channel.find_positions(self._time.counter, centre_mode)

    # -- updates ----------------------------------------------------------------------------------------

    def _updated(self, count: int) -> None:
        """``count`` updates have happened, the first of them with what was preloaded."""
        self._load()
        if self.registers[CR1] & _OPM:
            self.registers[CR1] &= ~_CEN
        self._raise_update_flag(count)
        if self.registers[DIER] & _UDE:
            self.soc.dma.request(f"{self.name}_UP")

    def _load(self) -> None:
        """The preloaded registers become the active ones."""
        if self._loaded:
            return
        self._loaded = True
        time = self._time
        time.prescale = self.registers[PSC] + 1
        time.repetition = self.registers.get(RCR, 0)
        time.counter.reload(self.registers[ARR])
        for index, channel in enumerate(self._channels):
            if not channel.is_input:
                channel.compare = self.registers[CCR1 + 4 * index]
        self._place_channels()

    def _raise_update_flag(self, count: int) -> None:
        if not self.registers[SR] & _UIF:
            self.registers[SR] |= _UIF
            count -= 1
            if self.registers[DIER] & _UIE:
                self.account.due(self.soc.clock.now_ps)
        if count and self.account.waiting:
            self.account.missed(count)

    # -- compare and capture ----------------------------------------------------------------------------

    def _raise_compare_flags(self, steps: int) -> None:
        """Flags of the values the counter passes in its next ``steps`` counts."""
        counter = self._time.counter
        if not ~self.registers[SR] & _COMPARE_FLAGS:
            return
        for channel in self._channels:
            if not self.registers[SR] & channel.flag and any(
                counter.steps_to(position) <= steps for position in channel.positions
            ):
                self.registers[SR] |= channel.flag

    def _pin_changed(self, number: int, port: str, pin: int, level: int) -> None:
        if self.soc.gpio.alternate(port, pin) != self._variant.alternate:
            return
        self._time.catch_up(self.soc.clock.now_ps)
        for channel in self._channels:
            if channel.listens_to(number) and channel.captures(level):
                self._capture(channel)
        self._settle()

    def _capture(self, channel: Channel) -> None:
        if self.registers[SR] & channel.flag:
            self.registers[SR] |= channel.overcapture
        self.registers[SR] |= channel.flag
        self.registers[CCR1 + 4 * (channel.number - 1)] = self._time.counter.value

    # -- time and interrupts ----------------------------------------------------------------------------

    def _input_hz(self) -> int:
        return self.soc.clocks.timer1_hz if self._variant.apb == 1 else self.soc.clocks.timer2_hz

    def _clock_changed(self) -> None:
        now_ps = self.soc.clock.now_ps
        self._time.catch_up(now_ps)
        self._time.set_hz(now_ps, self._input_hz())
        self._settle()

    def _sync(self) -> None:
        self._time.catch_up(self.soc.clock.now_ps)
        self._settle()

    def _settle(self) -> None:
        """After any change: when the next flag rises, whether that needs an event, and who interrupts now."""
        status, enabled = self.registers[SR], self.registers[DIER]
        self._next_ps = self._next_flag_ps(~status)
        wanted = enabled & ~status & self._masks[SR] & 0x1F or enabled & _UDE
        self._set_event(self._next_ps if wanted else NEVER_PS)
        active = status & enabled
        for flags, irq in self._irqs:
            irq.set(self.name, bool(active & flags))

    def _next_flag_ps(self, missing: int) -> int:
        time = self._time
        if not time.running or time.counter.blocked:
            return NEVER_PS
        steps = []
        if missing & _COMPARE_FLAGS:
            steps = [
                time.counter.steps_to(position)
                for channel in self._channels
                if missing & channel.flag
                for position in channel.positions
            ]
        update = time.steps_to_update()
        # compare values may change at an update, so no flag is predicted beyond it
        if update is not None and (steps or missing & _UIF or time.one_pulse or self.registers[DIER] & _UDE):
            steps.append(update)
        return time.time_ps(min(steps)) if steps else NEVER_PS

    def _set_event(self, at_ps: int) -> None:
        if at_ps == self._event_ps:
            return
        if self._event is not None:
            self._event.cancel()
            self._event = None
        self._event_ps = at_ps
        if at_ps < NEVER_PS:
            self._event = self.soc.clock.schedule(at_ps, self._due)

    def _due(self) -> None:
        self._event, self._event_ps = None, NEVER_PS
        self._sync()


def _nothing() -> None:
    """A register that waits to be loaded."""
