"""The native engine and Unicorn run the same boards: text, transfers and their times, pins, registers, RAM.

Exceptions, waiting, I2C and events of the clock, which the native engine deals with by itself in the usual
cases, are what is compared here; single instructions are in the other files of this name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from emulator.arm.cpu import engines
from emulator.arm.cpu.native_engine import NativeEngine
from emulator.arm.cpu.unicorn_engine import UnicornEngine
from emulator.clock import PS_PER_MS, PS_PER_S
from emulator.i2c import I2CFault
from firmware_model.arm import prebuilt
from tests.arm.engine_pair import needs_native
from tests.arm.speed_bench import Chip, Result
from tests.arm.speed_programs import I2C_BY_DMA, I2C_BY_INTERRUPT, POLLS_A_PIN, SHOWS_A_PIN, program

pytestmark = needs_native
BOOTED_PS = 1_000 * PS_PER_MS
_STACK_WORDS = 256
_GE = np.uint32(0xF << 16)
_THUMB, _SAVED_XPSR = np.uint32(1 << 24), np.uint32(0x07F0_FC00)
"""A saved xPSR has T, and none of these others."""


def ran(
    engine: str,
    monkeypatch: pytest.MonkeyPatch,
    file: Path,
    times_ps: Iterable[int],
    profile: str = "lab3",
    faults: Iterable[I2CFault] = (),
) -> Result:
    """A run until each of these times, one after the other."""
    monkeypatch.setenv(engines.VARIABLE, engine)
    chip = Chip(file, profile)
    kind = NativeEngine if engine == engines.NATIVE else UnicornEngine
    assert type(chip.core.engine) is kind
    for fault in faults:
        chip.board.i2c2.inject(fault)
    for at_ps in times_ps:
        chip.run_until(at_ps)
    return without_ge(chip.result())


def without_ge(result: Result) -> Result:
    """Unicorn does not restore GE when an exception returns: what it saves of it differs, too."""
    registers, ram = (np.frombuffer(part, "<u4").copy() for part in (result.registers, result.ram))
    registers[16] &= ~_GE
    stack = ram[-_STACK_WORDS:]
    stack[(stack & _SAVED_XPSR) == _THUMB] &= ~_GE
    return replace(result, registers=registers.tobytes(), ram=ram.tobytes())


def of_both(
    monkeypatch: pytest.MonkeyPatch,
    file: Path,
    times_ps: Iterable[int],
    profile: str = "lab3",
    faults: Iterable[I2CFault] = (),
) -> list[Result]:
    times, broken = list(times_ps), list(faults)
    return [ran(name, monkeypatch, file, times, profile, broken) for name in engines.CHOICES]


@pytest.mark.parametrize("program_name", ["solution", "template-arm"])
@pytest.mark.parametrize(("bus", "profile"), [("I2C2", "lab3"), ("SPI2", "fcu001v1")])
def test_the_shipped_firmware_does_the_same(
    monkeypatch: pytest.MonkeyPatch, program_name: str, bus: str, profile: str
) -> None:
    file = prebuilt(program_name.removesuffix("-arm"), bus)
    native, unicorn = of_both(monkeypatch, file, [BOOTED_PS + 120 * PS_PER_MS], profile)

    assert native == unicorn
    assert native.terminal.count(b"initialized and enabled") == 5
    assert len(native.transfers) > 90


def test_a_run_may_be_divided_anyhow(monkeypatch: pytest.MonkeyPatch) -> None:
    """In slices of 1 ps to 7 ms; with and without them all is the same."""
    file = prebuilt("solution", "I2C2")
    end_ps = BOOTED_PS + 60 * PS_PER_MS
    cuts = [BOOTED_PS]
    step = 1
    while cuts[-1] < end_ps:
        cuts.append(cuts[-1] + step)
        step = step * 7919 % (7 * PS_PER_MS) + 1
    cuts[-1] = end_ps
    whole = ran(engines.NATIVE, monkeypatch, file, [end_ps])
    divided = ran(engines.NATIVE, monkeypatch, file, cuts)

    assert min(later - sooner for sooner, later in pairwise(cuts[:4])) < 10_000
    assert divided == whole == ran(engines.UNICORN, monkeypatch, file, cuts)


@pytest.mark.parametrize(
    "fault",
    [
        I2CFault("nack", BOOTED_PS, PS_PER_S + 30 * PS_PER_MS, address=0x6B, byte_index=1),
        I2CFault("absent", BOOTED_PS, PS_PER_S + 30 * PS_PER_MS, address=0x1E),
        I2CFault("stuck", BOOTED_PS, PS_PER_S + 30 * PS_PER_MS),
    ],
    ids=lambda fault: fault.kind,
)
def test_a_broken_bus_is_the_same_for_both(monkeypatch: pytest.MonkeyPatch, fault: I2CFault) -> None:
    file = prebuilt("solution", "I2C2")
    native, unicorn = of_both(monkeypatch, file, [PS_PER_S + 50 * PS_PER_MS], faults=[fault])

    assert native == unicorn
    assert native.edges


@pytest.mark.parametrize(
    "source",
    [I2C_BY_INTERRUPT, I2C_BY_DMA, POLLS_A_PIN, SHOWS_A_PIN],
    ids=["interrupts", "dma", "polls a pin", "shows a pin"],
)
def test_other_programs_do_the_same(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, source: str) -> None:
    file = tmp_path / "program.bin"
    file.write_bytes(program(source))
    native, unicorn = of_both(monkeypatch, file, [10 * PS_PER_MS, 20 * PS_PER_MS])

    assert native == unicorn
    assert native.retired > 10_000
