"""From the chip at the end of a run to a diagnosis: what is certain and worst comes first."""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import Protocol

from emulator.boards.signals import BoardSignals
from emulator.chip.chip import Chip
from emulator.chip.cpu.core import Core
from emulator.chip.cpu.fault_log import CORE, FaultLog, FaultRecord, word_of
from emulator.chip.diagnosis.backtrace import NOTE, Backtrace, Places
from emulator.chip.diagnosis.evidence import BlockNotes, Transfers, nobody
from emulator.chip.diagnosis.faults import fault_report
from emulator.chip.diagnosis.hang import Hang
from emulator.chip.diagnosis.report import Diagnosis, at, milliseconds, section
from emulator.chip.image import FirmwareImage
from emulator.chip.memory_map import RAM_MEMORY
from emulator.chip.peripherals.tim import Timer
from emulator.time.clock import PS_PER_MS, PS_PER_S
from emulator.trace import BusTransfer, GpioEdge


class RunningFirmware(Protocol):
    """A chip and what it executes: :class:`emulator.chip.firmware.ArmFirmware`."""

    image: FirmwareImage
    chip: Chip
    faults: FaultLog
    signals: BoardSignals


def diagnose(arm: RunningFirmware) -> Diagnosis | None:
    """What is wrong with the firmware as it is now; None if nothing is seen to be wrong.

    Nothing of the board is changed by looking.
    """
    signals, core = arm.signals, arm.chip.core
    places = Places(arm.image)
    transfers = Transfers(signals)
    notes = BlockNotes(arm.chip, signals.trace)
    return (
        fault_report(core, arm.faults, places, transfers.lines())
        or _stack(arm, places)
        or Hang(arm.chip, places, transfers, notes, _quiet_since_ps(arm, transfers)).diagnosis()
        or reset_report(core, places, arm.faults.origin)
        or slow_callback(arm.chip, places)
        or _without_clock(notes)
        or _unanswered(arm, transfers)
    )


def _quiet_since_ps(arm: RunningFirmware, transfers: Transfers) -> int:
    """When something last happened on the buses, the terminal or the pins."""
    signals = arm.signals
    edges = [edge.t_ps for edge in signals.trace.of(GpioEdge)[-1:]]
    signals.uart.catch_up()
    terminal_ps = min(signals.uart.idle_ps, signals.clock.now_ps)
    return max([transfers.last_ps, terminal_ps, *edges])


def _stack(arm: RunningFirmware, places: Places) -> Diagnosis | None:
    """The main stack has been in the variables, as seen at the entries of exceptions."""
    lowest, end = arm.chip.core.lowest_stack, places.end_of_variables()
    if end is None or not RAM_MEMORY.start <= lowest < end < places.stack_top:
        return None
    return Diagnosis(
        "stack",
        f"stack overflow: the stack has gone down to 0x{lowest:08X}, {end - lowest} bytes into the variables",
        (
            (
                f"The variables end at 0x{end:08X} and the stack begins at 0x{places.stack_top:08X}; "
                f"{places.variable(lowest)} was overwritten."
            ),
            "A deep recursion, or arrays in functions that are too large for the stack.",
        ),
    )


def _without_clock(notes: BlockNotes) -> Diagnosis | None:
    cause = notes.cause()
    if cause is None:
        return None
    details = (*cause.sentences, *section("not allowed", notes.lines()))
    return Diagnosis("clock", cause.short, details, fatal=False)


def _unanswered(arm: RunningFirmware, transfers: Transfers) -> Diagnosis | None:
    """Transfers to addresses where no device is, in a program that goes on all the same."""
    signals = arm.signals
    failed = Counter(
        (event.bus, event.address)
        for event in signals.trace.of(BusTransfer)
        if event.bus in signals.i2c and event.result != "ok" and not event.device
    )
    if not failed:
        return None
    (bus, address), count = failed.most_common(1)[0]
    cause = nobody(signals, signals.i2c[bus], address)
    details = (
        *cause.sentences,
        f"{count} transfer{'s' * (count > 1)} failed so; the program goes on without them.",
        *section("last transfers", transfers.lines()),
    )
    return Diagnosis("bus", cause.short, details, fatal=False)


# -- a timer's callback that takes longer than the timer's period -------------------------------------------

_CALLBACK = "HAL_TIM_PeriodElapsedCallback"
_FEWEST_TICKS = 20  # a shorter account says nothing
_STARVED_PS = 100 * PS_PER_MS


def slow_callback(chip: Chip, places: Places) -> Diagnosis | None:
    """The first timer that loses more than a tenth of its ticks.

    How long its callback takes is not measured but follows from the account of ticks: while the handler takes
    longer than the period, it is entered again as soon as it has returned, so it takes the period times the
    ticks due for each one handled.

    Decision: never called a failure. A scenario may slow the bus down to show just this.
    """
    for timer in chip.timers.values():
        if timer.ticks >= _FEWEST_TICKS and timer.lost * 10 > timer.ticks and timer.rate_hz:
            return _slow(chip, places, timer)
    return None


def _slow(chip: Chip, places: Places, timer: Timer) -> Diagnosis:
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


# -- a chip that was reset: by a watchdog, or again and again by its own firmware (RM0368 sections 15, 16) --

_WATCHDOGS = {
    "IWDG": "the independent watchdog: HAL_IWDG_Refresh() was not called in time",
    "WWDG": "the window watchdog: HAL_WWDG_Refresh() was called too late, or too early",
}
_MANY_RESETS = 3
_SP, _LR, _PC = 13, 14, 15


def reset_report(core: Core, places: Places, fault: FaultRecord | None) -> Diagnosis | None:
    """Where the latest reset has met the firmware; None if there was none to speak of."""
    resets = core.resets
    if not resets or (resets[-1][1] not in _WATCHDOGS and len(resets) < _MANY_RESETS):
        return None
    t_ps, reason = resets[-1]
    state, ram = core.before_reset
    registers = CORE.unpack(state)
    trace = Backtrace(places, partial(word_of, ram), core.memory)
    callers = trace.lines(registers[_PC], registers[_LR], registers[_SP])
    why = f"is {_WATCHDOGS[reason]}" if reason in _WATCHDOGS else "was asked for by the firmware itself"
    details = [f"{reason} {why}."]
    if fault is not None:
        details.append(f"There was a fault at {at(fault.t_ps)} in {places.place(fault.pc)}.")
    times = f"{len(resets)} times, last" if len(resets) > 1 else "once,"
    return Diagnosis(
        "reset",
        f"the chip was reset {times} by {reason} at {at(t_ps)}, while in {places.place(registers[_PC])}",
        (*details, *section(f"callers ({NOTE})", callers)),
        fatal=False,
    )
