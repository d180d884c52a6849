"""From the chip at the end of a run to a diagnosis: what is certain and worst comes first."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from emulator.chip.diagnosis.addresses import nobody
from emulator.chip.diagnosis.blocks import BlockNotes
from emulator.chip.diagnosis.callback import slow_callback
from emulator.chip.diagnosis.fault_report import fault_report
from emulator.chip.diagnosis.hang import Hang
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.report import Diagnosis, section
from emulator.chip.diagnosis.resets import reset_report
from emulator.chip.diagnosis.transfers import Transfers
from emulator.chip.image.memory_map import RAM
from emulator.trace import BusTransfer, GpioEdge

if TYPE_CHECKING:
    from emulator.chip.firmware import ArmFirmware


def diagnose(arm: ArmFirmware) -> Diagnosis | None:
    """What is wrong with the firmware as it is now; None if nothing is seen to be wrong.

    Nothing of the board is changed by looking.
    """
    around, core = arm.surroundings, arm.chip.core
    places = Places(arm.image)
    transfers = Transfers(around)
    notes = BlockNotes(arm.chip, around.trace)
    return (
        fault_report(core, arm.faults, places, transfers.lines())
        or _stack(arm, places)
        or Hang(arm.chip, places, transfers, notes, _quiet_since_ps(arm, transfers)).diagnosis()
        or reset_report(core, places, arm.faults.origin)
        or slow_callback(arm.chip, places)
        or _without_clock(notes)
        or _unanswered(arm, transfers)
    )


def _quiet_since_ps(arm: ArmFirmware, transfers: Transfers) -> int:
    """When something last happened on the buses, the terminal or the pins."""
    around = arm.surroundings
    edges = [edge.t_ps for edge in around.trace.of(GpioEdge)[-1:]]
    around.uart.catch_up()
    terminal_ps = min(around.uart.idle_ps, around.clock.now_ps)
    return max([transfers.last_ps, terminal_ps, *edges])


def _stack(arm: ArmFirmware, places: Places) -> Diagnosis | None:
    """The main stack has been in the variables, as seen at the entries of exceptions."""
    lowest, end = arm.chip.core.lowest_stack, places.end_of_variables()
    if end is None or not RAM.start <= lowest < end < places.stack_top:
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


def _unanswered(arm: ArmFirmware, transfers: Transfers) -> Diagnosis | None:
    """Transfers to addresses where no device is, in a program that goes on all the same."""
    bus = arm.surroundings.i2c2
    failed = Counter(
        event.address
        for event in arm.surroundings.trace.of(BusTransfer)
        if event.bus == bus.name and event.result != "ok" and not event.device
    )
    if not failed:
        return None
    address, count = failed.most_common(1)[0]
    cause = nobody(bus, address, bool(arm.surroundings.spi2.chip_selects))
    details = (
        *cause.sentences,
        f"{count} transfer{'s' * (count > 1)} failed so; the program goes on without them.",
        *section("last transfers", transfers.lines()),
    )
    return Diagnosis("bus", cause.short, details, fatal=False)
