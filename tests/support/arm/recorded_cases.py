"""The runs whose records are kept: shipped firmware on both wirings, and programs of the tests.

Times are short: a board boots in about a second, and most of this is waiting.
"""

from __future__ import annotations

from collections.abc import Iterator

from fcu_emulator.emulator.buses.i2c import I2CFault
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from tests.support.arm import recorded_assembly, speed_programs
from tests.support.arm.broken_programs import FOLDER as BROKEN
from tests.support.arm.broken_programs import RUN_S
from tests.support.arm.recorded_assembly import chip_program
from tests.support.arm.recording import Case
from tests.support.arm.speed_programs import program
from tests.support.arm.vendor_programs import file

_WIRINGS = {"i2c2": "lab3", "spi2": "fcu001v1"}
_NOISY = {"scenario": "desk", "ideal": False, "steady": False}
_MOVING = {"scenario": "figure_eight", "ideal": False, "steady": False}
_BROKEN_S = {
    **RUN_S,
    "poll_for_ever": 0.2,
    "clock_is_not_the_cause": 0.2,
    "error_in_main": 0.2,
    "fine_quiet": 0.05,
    "fine_callback": 0.05,
}
"""Times that are shorter than a diagnosis needs, for programs that only repeat."""


def _shipped() -> Iterator[Case]:
    for bus, wiring in _WIRINGS.items():
        for firmware in ("solution", "template-arm"):
            yield Case(f"{firmware}-{bus}-still", firmware, 1.15, wiring)
        yield Case(f"solution-{bus}-desk", "solution", 1.1, wiring, **_NOISY)
        yield Case(f"solution-{bus}-cold-start", "solution", 1.05, wiring, cold_start=True)
    yield Case("solution-i2c2-two-blocks", "solution", 2.2)
    yield Case("solution-i2c2-slow-bus", "solution", 1.3, None, "slow_bus", ideal=False, steady=False)
    for kind in ("nack", "absent", "stuck"):
        begin, end = PS_PER_S, PS_PER_S + 50 * PS_PER_MS
        where = {"nack": {"address": 0x6B, "byte_index": 1}, "absent": {"address": 0x1E}, "stuck": {}}[kind]
        yield Case(
            f"solution-i2c2-{kind}", "solution", 1.15, broken_bus=(I2CFault.in_ps(kind, begin, end, **where),)
        )


def _vendor() -> Iterator[Case]:
    for way in ("polled", "it", "dma"):
        yield Case(f"vendor-lab3-i2c-{way}", file(f"lab3_i2c_{way}"), 1.15)
    yield Case("vendor-lab3-i2c-it-desk", file("lab3_i2c_it"), 1.08, **_NOISY)
    begin, end = PS_PER_S + 70 * PS_PER_MS, PS_PER_S + 90 * PS_PER_MS
    nack = (I2CFault.in_ps("nack", begin, end, address=0x1E, byte_index=0),)
    yield Case("vendor-lab3-i2c-it-nack", file("lab3_i2c_it"), 1.1, broken_bus=nack)
    typed = ((0.02, b"hello"), (0.05, bytes(range(32, 127))), (0.0701, b"x"), (0.0705, b"y" * 70))
    for way in ("it", "dma"):
        yield Case(f"vendor-uart-{way}", file(f"uart_{way}"), 0.25, typed=typed)
    edges = tuple((0.003 + 0.00037 * n, "A", 0, n % 2) for n in range(1, 160))
    yield Case("vendor-events", file("events"), 0.065, levels=edges)
    yield Case("vendor-all-blocks", file("all_blocks"), 0.12)
    yield Case("vendor-threads", file("threads"), 0.15)
    yield Case("vendor-flight", file("flight"), 1.09, "fcu001v1")
    yield Case("vendor-flight-figure-eight", file("flight"), 1.075, "fcu001v1", **_MOVING)


def _broken() -> Iterator[Case]:
    for name, seconds in _BROKEN_S.items():
        yield Case(f"broken-{name}", BROKEN / f"{name}.elf", seconds)


def _assembly() -> Iterator[Case]:
    pin = tuple((0.001 * n + 0.0003, "A", 0, n % 2) for n in range(1, 20))
    for name in ("I2C_BY_INTERRUPT", "I2C_BY_DMA", "COUNTS_IN_RAM", "LOSES_THE_CLOCK", "ARITHMETIC"):
        source = getattr(speed_programs, name)
        yield Case(f"assembly-{name.lower().replace('_', '-')}", program(source), 0.02)
    for name in ("POLLS_A_PIN", "SHOWS_A_PIN"):
        source = getattr(speed_programs, name)
        yield Case(f"assembly-{name.lower().replace('_', '-')}", program(source), 0.021, levels=pin)


_ASSEMBLY_S = {
    "SLEEP": 0.03,
    "STOP_MODE": 0.021,
    "IWDG": 0.06,
    "WWDG": 0.03,
    "NESTED": 0.02,
    "FAULTS": 0.005,
    "LOCK_UP": 0.002,
    "IT_BLOCKS": 0.01,
    "MEMORY": 0.002,
    "EDGES": 0.021,
}


def _core() -> Iterator[Case]:
    edges = tuple((0.00037 * n + 0.001, "A", 0, n % 2) for n in range(1, 50))
    for name, seconds in _ASSEMBLY_S.items():
        levels = edges if name in ("STOP_MODE", "EDGES") else ()
        source = getattr(recorded_assembly, name)
        yield Case(f"core-{name.lower().replace('_', '-')}", chip_program(source), seconds, levels=levels)


CASES = {case.name: case for case in (*_shipped(), *_vendor(), *_broken(), *_assembly(), *_core())}
