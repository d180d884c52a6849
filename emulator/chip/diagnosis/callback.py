"""A timer's callback that takes longer than the timer's period.

How long it takes is not measured but follows from the account of ticks: while the handler takes longer than
the period, it is entered again as soon as it has returned, so it takes the period times the ticks due for
each one handled.

Decision: never called a failure. A scenario may slow the bus down to show just this.
"""

from __future__ import annotations

from emulator.chip.chip import Chip
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.report import Diagnosis, at, milliseconds
from emulator.chip.peripherals.tim import Timer
from emulator.time.clock import PS_PER_MS, PS_PER_S

_CALLBACK = "HAL_TIM_PeriodElapsedCallback"
_FEW = 20  # ticks: a shorter account says nothing
_STARVED_PS = 100 * PS_PER_MS


def slow_callback(chip: Chip, places: Places) -> Diagnosis | None:
    """The first timer that loses more than a tenth of its ticks."""
    for timer in chip.timers.values():
        if timer.ticks >= _FEW and timer.lost * 10 > timer.ticks and timer.rate_hz:
            return _report(chip, places, timer)
    return None


def _report(chip: Chip, places: Places, timer: Timer) -> Diagnosis:
    core = chip.core
    period_ps = PS_PER_S / timer.rate_hz
    taken = milliseconds(round(period_ps * timer.ticks / (timer.ticks - timer.lost)))
    name = f"{_CALLBACK}()" if places.address_of(_CALLBACK) else f"the handler of {timer.name}"
    summary = f"{name} takes about {taken} of a {milliseconds(round(period_ps))} tick"
    details = [
        (
            f"{timer.name} runs at {timer.rate_hz:g} Hz; of {timer.ticks} ticks {timer.lost} were lost and "
            f"{timer.late} came late."
        ),
        "Fewer or shorter transfers, a faster bus, a lower rate, or less arithmetic in the callback help.",
    ]
    starved = core.active and core.now_ps - core.thread_ps > _STARVED_PS
    if starved:
        since = f"main() has not run since {at(core.thread_ps)}"
        details.insert(0, f"{since}: when the callback returns, the next tick is waiting already.")
        summary += ": main() never runs"
    return Diagnosis("callback", summary, tuple(details), fatal=False)
