"""Diagnoses of a chip after a run, the most severe first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Protocol

from fcu_emulator.emulator.boards.description import BoardSignals
from fcu_emulator.emulator.buses.i2c import is_scan
from fcu_emulator.emulator.chip.chip import Chip
from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.fault_log import CORE, FaultLog, FaultRecord, word_of
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK, NOTE, Backtrace, Places
from fcu_emulator.emulator.chip.diagnosis.evidence import (
    TRANSFERS_SHOWN,
    PeripheralNotes,
    RecentTransfers,
    nobody,
)
from fcu_emulator.emulator.chip.diagnosis.faults import (
    fault_before_reset,
    fault_report,
    is_reset_endlessly,
    lost_store_report,
)
from fcu_emulator.emulator.chip.diagnosis.hang import Hang
from fcu_emulator.emulator.chip.diagnosis.memory_use import flash_nearly_full, ram_nearly_full
from fcu_emulator.emulator.chip.diagnosis.printing import LATEST_TEXT, PrintedLines, misprinted
from fcu_emulator.emulator.chip.diagnosis.report import Cause, Diagnosis, at, milliseconds, section
from fcu_emulator.emulator.chip.diagnosis.setup import (
    bus_never_on,
    byte_left,
    never_ticked,
    not_enabled,
    printed_elsewhere,
    silent_terminal,
    wrong_baud,
    wrong_rate,
)
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.memory_map import RAM_MEMORY
from fcu_emulator.emulator.chip.peripherals.tim import Timer
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote, GpioEdge, Trace


class RunningFirmware(Protocol):
    """A chip with its firmware: :class:`fcu_emulator.emulator.chip.firmware.ArmFirmware`."""

    image: FirmwareImage
    chip: Chip
    faults: FaultLog
    signals: BoardSignals


_SET_UP_PS = PS_PER_S // 2


def diagnose(arm: RunningFirmware) -> Diagnosis | None:
    """Return the firmware's worst problem."""
    return next(findings(arm), None)


def findings(arm: RunningFirmware) -> Iterator[Diagnosis]:
    """Yield all problems, the worst first. No problem is yielded after a fatal one."""
    signals, chip = arm.signals, arm.chip
    places = Places(arm.image)
    transfers = RecentTransfers(signals)
    if chip.low_power.in_standby:  # registers and RAM are lost
        asleep = Hang(
            chip,
            places,
            transfers,
            PeripheralNotes(chip, signals.trace),
            _quiet_since_ps(arm, transfers),
        ).diagnosis()
        yield from (one for one in (asleep,) if one)
        return
    notes = PeripheralNotes(chip, signals.trace)
    quiet_since_ps = _quiet_since_ps(arm, transfers)
    bus = bus_never_on(chip, signals, places) or byte_left(chip, signals)
    crash = fault_before_reset(chip.core, arm.faults.origin, places, transfers.lines())
    resets = crash or reset_report(chip.core, places, arm.faults.origin)
    failed = (
        fault_report(chip.core, arm.faults, places, transfers.lines())
        or (resets if resets and resets.fatal else None)
        or _stack(arm, places)
        or Hang(chip, places, transfers, notes, quiet_since_ps, bus).diagnosis()
    )
    if failed is not None:
        yield failed
        if failed.fatal:
            return
    text = bytes(signals.uart.received()[-LATEST_TEXT:])
    seen = (
        lost_store_report(arm.faults.lost_store, chip.core.memory, places),
        resets,
        slow_callback(chip, places),
        _wrong_crystal(signals.trace),
        _without_clock(notes),
        _unanswered(arm, transfers),
        _unselected(transfers),
        bus and _bus(bus, signals.clock.now_ps),
        printed_elsewhere(chip, signals) or silent_terminal(chip, signals, places),
        wrong_baud(chip, signals),
        not_enabled(chip),
        never_ticked(chip, signals, places),
        wrong_rate(chip, signals),
        flash_nearly_full(arm.image),
        ram_nearly_full(chip.core, places),
        misprinted(PrintedLines(arm.image, places, text), places) if text else None,
    )
    yield from (one for one in seen if one)


def _quiet_since_ps(arm: RunningFirmware, transfers: RecentTransfers) -> int:
    signals = arm.signals
    edges = [edge.t_ps for edge in signals.trace.of(GpioEdge)[-1:]]
    signals.uart.catch_up()
    terminal_ps = min(signals.uart.idle_ps, signals.clock.now_ps)
    return max([transfers.last_ps, terminal_ps, *edges])


def _stack(arm: RunningFirmware, places: Places) -> Diagnosis | None:
    lowest, end = arm.chip.core.lowest_stack, places.end_of_variables()
    if end is None or not RAM_MEMORY.start <= lowest < end < places.stack_top:
        return None
    return Diagnosis(
        "stack",
        f"stack overflow: the stack has grown down to 0x{lowest:08X}, {end - lowest} bytes into the variables",
        (
            (
                f"The variables end at 0x{end:08X} and the stack begins at 0x{places.stack_top:08X}; "
                f"{places.variable(lowest)} was overwritten."
            ),
            "The cause is deep recursion, or a local array that is too large for the stack.",
        ),
    )


def _wrong_crystal(trace: Trace) -> Diagnosis | None:
    """Report PLL settings that fit another board's crystal."""
    for note in trace.of(DeviceNote):
        if note.problem == "wrong-crystal":
            violated, _, crystal = note.text.partition("; ")
            summary = f"the program is made for another crystal: {crystal}"
            look = "HSE_VALUE and PLLM have to fit the board; all times and rates of the program are wrong."
            return Diagnosis("clock", summary, (f"At {at(note.t_ps)}: {violated}.", look), fatal=False)
    return None


def _without_clock(notes: PeripheralNotes) -> Diagnosis | None:
    cause = notes.cause()
    if cause is None:
        return None
    details = (*cause.sentences, *section("not allowed", notes.lines()))
    return Diagnosis("clock", cause.short, details, fatal=False)


def _unanswered(arm: RunningFirmware, transfers: RecentTransfers) -> Diagnosis | None:
    signals = arm.signals
    failed = [
        event
        for event in signals.trace.of(BusTransfer)
        if event.bus in signals.i2c and event.result != "ok" and not event.device
    ]
    counts = Counter((one.bus, one.address) for one in failed)
    if not failed or is_scan(counts.values()):
        return None
    ((bus, address), count), *_ = counts.most_common(1)
    cause = nobody(signals, signals.i2c[bus], address)
    these = [one for one in failed if (one.bus, one.address) == (bus, address)][-TRANSFERS_SHOWN:]
    details = (
        *cause.sentences,
        f"{count} transfer{'s' * (count > 1)} failed in this way; the program continues without them.",
        *section("last failed transfers", transfers.texts(these)),
    )
    return Diagnosis("bus", cause.short, details, fatal=False)


def _bus(cause: Cause, now_ps: int) -> Diagnosis | None:
    if now_ps < _SET_UP_PS:
        return None
    return Diagnosis("bus", cause.short, tuple(cause.sentences), fatal=False)


def _unselected(transfers: RecentTransfers) -> Diagnosis | None:
    cause = transfers.nobody_on_spi() or transfers.silent_sensors()
    return cause and Diagnosis("bus", cause.short, tuple(cause.sentences), fatal=False)


# -- timer callbacks ----------------------------------------------------------------------------------------

_FEWEST_TICKS = 20  # with fewer ticks, the counts of late and lost ticks prove nothing
_STARVED_PS = 100 * PS_PER_MS
_WAITING = {
    "HAL_Delay": "Do not wait in an interrupt: count calls in the callback, or wait in main().",
    "PRINTF": "Do not print in an interrupt, because a character takes 87 us: set a flag, and print in main().",
    "HAL_UART_Transmit": "Do not print in an interrupt: a character takes 87 us.",
}


def slow_callback(chip: Chip, places: Places) -> Diagnosis | None:
    """Report the first timer that loses more than a tenth of its ticks.

    If the callback waits or prints, it is enough that one tick is lost or that more than 1 % of the ticks are late.
    The duration of a slow handler is estimated as period * due ticks / handled ticks.

    Decision: a slow timer callback never counts as a failure, because a scenario may slow the bus
    down on purpose.
    """
    for timer in chip.timers.values():
        if timer.ticks < _FEWEST_TICKS or not timer.rate_hz:
            continue
        if timer.lost * 10 > timer.ticks:
            return _slow(chip, places, timer)
        if timer.lost or timer.late * 100 > timer.ticks:
            found = _sometimes_slow(chip, places, timer)
            if found is not None:
                return found
    return None


def _sometimes_slow(chip: Chip, places: Places, timer: Timer) -> Diagnosis | None:
    waits = waiting_call(chip, places)
    if waits is None:
        return None
    site, name = waits
    period = milliseconds(round(PS_PER_S / timer.rate_hz))
    counts = f"of {timer.ticks} ticks {timer.lost} were lost and {timer.late} came late"
    details = (
        f"{timer.name} runs at {timer.rate_hz:g} Hz; {counts}.",
        f"The callback calls {name}() in {places.place(site)}.",
        _WAITING[name],
    )
    summary = f"{CALLBACK}() occasionally takes longer than the timer's period of {period}"
    return Diagnosis("callback", summary, details, fatal=False)


def waiting_call(chip: Chip, places: Places) -> tuple[int, str] | None:
    """Return the callback's call of a function that waits or prints, and the function's name."""
    callback = places.address_of(CALLBACK)
    return places.call_of(_WAITING, callback, chip.core.memory) if callback is not None else None


def _slow(chip: Chip, places: Places, timer: Timer) -> Diagnosis:
    core = chip.core
    period_ps = PS_PER_S / timer.rate_hz
    taken = milliseconds(round(period_ps * timer.ticks / (timer.ticks - timer.lost)))
    name = f"{CALLBACK}()" if places.address_of(CALLBACK) else f"the handler of {timer.name}"
    summary = (
        f"{name} takes about {taken}, longer than the timer's period of {milliseconds(round(period_ps))}"
    )
    details = [
        (
            f"{timer.name} runs at {timer.rate_hz:g} Hz; of {timer.ticks} ticks {timer.lost} were lost and "
            f"{timer.late} came late."
        ),
        "Use fewer or shorter transfers, a faster bus, a lower rate, or less arithmetic in the callback.",
    ]
    waits = waiting_call(chip, places)
    if waits is not None:
        site, name = waits
        details.insert(0, f"The callback calls {name}() in {places.place(site)}.")
        details[-1] = _WAITING[name]
    starved = core.active and core.now_ps - core.thread_ps > _STARVED_PS
    if starved:
        since = f"main() has not run since {at(core.thread_ps)}"
        details.insert(0, f"{since}: the next tick is already due when the callback returns.")
        summary += ": main() never runs"
    return Diagnosis("callback", summary, tuple(details), fatal=False)


# -- resets (RM0368 sections 15, 16) ------------------------------------------------------------------------

_WATCHDOGS = {
    "IWDG": "the independent watchdog: HAL_IWDG_Refresh() was not called in time",
    "WWDG": "the window watchdog: HAL_WWDG_Refresh() was called too late, or too early",
}
_MANY_RESETS = 3
_SP, _LR, _PC = 13, 14, 15


def reset_report(core: Core, places: Places, fault: FaultRecord | None) -> Diagnosis | None:
    """Report the latest watchdog reset, or repeated resets."""
    resets = core.resets
    if not resets or (resets[-1][1] not in _WATCHDOGS and len(resets) < _MANY_RESETS):
        return None
    t_ps, reason = resets[-1]
    state, ram = core.before_reset
    registers = CORE.unpack(state)
    trace = Backtrace(places, partial(word_of, ram), core.memory)
    callers = trace.lines(registers[_PC], registers[_LR], registers[_SP])
    why = f"is {_WATCHDOGS[reason]}" if reason in _WATCHDOGS else "was requested by the firmware"
    details = [f"{reason} {why}."]
    if fault is not None:
        details.append(f"There was a fault at {at(fault.t_ps)} in {places.place(fault.pc)}.")
    times = f"{len(resets)} times, last" if len(resets) > 1 else "once,"
    return Diagnosis(
        "reset",
        f"the chip was reset {times} by {reason} at {at(t_ps)}, while in {places.place(registers[_PC])}",
        (*details, *section(f"callers ({NOTE})", callers)),
        fatal=is_reset_endlessly(core),
    )
