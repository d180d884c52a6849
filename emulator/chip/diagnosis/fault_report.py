"""A fault as a text: where, why, status registers, registers, who has called, what became of it."""

from __future__ import annotations

from collections.abc import Iterator

from emulator.chip.cpu import faults
from emulator.chip.cpu.core import Core
from emulator.chip.cpu.exceptions import BUS_FAULT, HARD_FAULT, MEM_MANAGE, NMI, USAGE_FAULT
from emulator.chip.cpu.fault_log import FaultLog, FaultRecord
from emulator.chip.diagnosis import fault_bits
from emulator.chip.diagnosis.backtrace import NOTE, Backtrace
from emulator.chip.diagnosis.fault_cause import cause_of
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.report import Diagnosis, at, section
from emulator.chip.image.memory_map import FLASH
from emulator.time.clock import PS_PER_MS

_NAMES = {
    HARD_FAULT: "HardFault",
    MEM_MANAGE: "MemManage fault",
    BUS_FAULT: "BusFault",
    USAGE_FAULT: "UsageFault",
}
_IN_HANDLER = 1 << NMI | sum(1 << number for number in _NAMES)
_MANY, _JUST_NOW_PS = 10, PS_PER_MS
_REGISTERS = (*(f"R{number}" for number in range(13)), "SP", "LR", "PC", "xPSR")


def fault_report(core: Core, log: FaultLog, places: Places, transfers: list[str]) -> Diagnosis | None:
    """The fault that the firmware has ended in; None if there was none, or it has recovered."""
    record, latest = log.origin, log.latest
    if record is None or latest is None:
        return None
    if core.locked_up:
        return _report(core, record, places, transfers, _locked_up(latest, places))
    if log.times >= _MANY and core.now_ps - log.last_ps < _JUST_NOW_PS:
        ending = (
            "The fault's handler returns to the same instruction, which faults again: "
            f"{log.times} times so far."
        )
        return _report(core, record, places, transfers, [ending])
    if core.active & _IN_HANDLER:
        return _report(core, record, places, transfers, _handler(core, places))
    return None


def _report(
    core: Core, record: FaultRecord, places: Places, transfers: list[str], ending: list[str]
) -> Diagnosis:
    code = core.memory
    cause = cause_of(record, places, code)
    trace = Backtrace(places, record.word, code)
    callers = trace.lines(record.pc, record.lr, record.sp)
    where = places.place(record.pc)
    if record.fault.status & faults.INVSTATE or not FLASH.holds(record.pc, record.pc):
        where = f"0x{record.pc:08X}, {callers[0] if callers else 'called from somewhere'}"
    details = [
        *cause.sentences,
        *section("fault status", list(_status(record))),
        *section("registers", list(_registers(record))),
        *section(f"callers ({NOTE})", callers),
        *ending,
        *section("last transfers", transfers),
        *places.help(),
    ]
    name = _name(core, record)
    return Diagnosis("fault", f"{name} at {at(record.t_ps)} in {where}: {cause.short}", tuple(details))


def _name(core: Core, record: FaultRecord) -> str:
    number = record.fault.exception
    own = core.active >> number & 1
    return _NAMES[number if own else HARD_FAULT]


def _status(record: FaultRecord) -> Iterator[str]:
    yield from fault_bits.decoded("CFSR", record.cfsr, fault_bits.CFSR)
    yield from fault_bits.decoded("HFSR", record.hfsr, fault_bits.HFSR)
    if record.fault.address is not None:
        yield f"BFAR 0x{record.fault.address:08X}"


def _registers(record: FaultRecord) -> Iterator[str]:
    named = [f"{name:4} {value:08X}" for name, value in zip(_REGISTERS, record.registers, strict=True)]
    for first in range(0, len(named), 4):
        yield "  ".join(named[first : first + 4])


def _handler(core: Core, places: Places) -> list[str]:
    return [f"Since then the fault's handler is running: {places.place(core.pc)}."]


def _locked_up(record: FaultRecord, places: Places) -> list[str]:
    return [
        f"Its handler faulted as well, in {places.place(record.pc)} at {at(record.t_ps)}.",
        "The core is locked up: only a reset helps.",
    ]
