"""A chip that was reset: by a watchdog, or again and again by its own firmware (RM0368 sections 15, 16)."""

from __future__ import annotations

from functools import partial

from emulator.chip.cpu.core import Core
from emulator.chip.cpu.fault_log import CORE, FaultRecord, word_of
from emulator.chip.diagnosis.backtrace import NOTE, Backtrace
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.report import Diagnosis, at, section

_WATCHDOGS = {
    "IWDG": "the independent watchdog: HAL_IWDG_Refresh() was not called in time",
    "WWDG": "the window watchdog: HAL_WWDG_Refresh() was called too late, or too early",
}
_MANY = 3
_SP, _LR, _PC = 13, 14, 15


def reset_report(core: Core, places: Places, fault: FaultRecord | None) -> Diagnosis | None:
    """Where the latest reset has met the firmware; None if there was none to speak of."""
    resets = core.resets
    if not resets or (resets[-1][1] not in _WATCHDOGS and len(resets) < _MANY):
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
