"""Diagnoses of broken student programs; the texts are in tests/arm/broken/expected."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from fcu_emulator import Board, I2CNackError
from fcu_emulator.emulator.chip.cpu.bare_core import BareCore
from fcu_emulator.emulator.chip.diagnosis import probe
from fcu_emulator.firmware_model import arm
from tests.support.arm.broken_programs import EXPECTED, FINE, FOLDER, RUN_S, diagnosed, run, without_times
from tests.support.words import Words

COMPILER = "arm-none-eabi-gcc"
RUNS_ON = {
    "ended",
    "flash_write",
    "gpio_without_clock",
    "null_pointer",
    "other_port",
    "reset_in_fault",
    "stripped",
    "slow_callback",
    "unshifted_address",
    "watchdog",
}
REBUILT = ("delay_in_callback", "no_clock", "null_pointer", "stack_overflow")

needs_compiler = pytest.mark.skipif(
    shutil.which(COMPILER) is None or shutil.which("make") is None,
    reason=f"{COMPILER} or make is not installed",
)


@pytest.mark.parametrize("name", RUN_S)
def test_broken_program_is_explained(name: str) -> None:
    expected = (EXPECTED / f"{name}.txt").read_text().rstrip("\n")

    assert without_times(diagnosed(name)) == without_times(expected)


@pytest.mark.parametrize("name", RUN_S)
def test_diagnosis_is_fatal_unless_program_continues(name: str) -> None:
    board = run(name)
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()

    assert diagnosis is not None
    assert diagnosis.fatal is (name not in RUNS_ON)
    assert "\n" not in diagnosis.summary
    assert str(diagnosis).splitlines()[0] == diagnosis.summary


@pytest.mark.parametrize("name", ["ended", "masked_delay", "fine_callback"])
def test_diagnosis_frees_its_copies(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy of the chip has more than a megabyte, and a live board is diagnosed for hours."""
    copies: list[BareCore] = []

    class Copy(BareCore):
        def __init__(self) -> None:
            super().__init__()
            copies.append(self)

    monkeypatch.setattr(probe, "BareCore", Copy)
    board = Board(firmware=FOLDER / f"{name}.elf")
    board.run_for(1.2)
    assert board.chip is not None
    board.chip.diagnosis()

    assert copies
    assert not any(len(copy.flash) for copy in copies)


def test_diagnosis_lists_unacknowledged_transfers(
    words: Words,
) -> None:
    board = Board(firmware="solution")
    board.run_for(1.5)
    for _ in range(2):
        with pytest.raises(I2CNackError):
            board.i2c2.write(0x35, b"\x0f")
    board.run_for(0.5)
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()

    assert diagnosis is not None
    assert diagnosis.kind == "bus"
    assert "0x35" in diagnosis.summary
    shown = [line.split("  ", 2)[2] for line in diagnosis.details if line.startswith("  ")]
    assert [text.partition(": ")[0] for text in shown] == ["I2C2 0x35"] * 2
    words("diagnosis", "\n".join((diagnosis.summary, *shown)))


def test_every_broken_program_has_expected_text() -> None:
    programs = {file.stem for file in FOLDER.glob("*.elf")}

    assert programs == {*RUN_S, *FINE}
    assert {file.stem for file in FOLDER.glob("*.c")} | {"stripped"} == programs
    assert {file.stem for file in EXPECTED.glob("*.txt")} == RUN_S.keys()


@pytest.mark.parametrize("name", FINE)
@pytest.mark.parametrize("seconds", [0.0, 0.001, 0.05, 1.2])
def test_waiting_or_interrupt_driven_program_has_no_diagnosis(name: str, seconds: float) -> None:
    board = Board(firmware=FOLDER / f"{name}.elf")
    board.run_for(seconds)
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()

    assert diagnosis is None or not diagnosis.fatal


@pytest.mark.parametrize("name", ["fine_idle_thread", "fine_threads"])
def test_switched_threads_are_not_stuck(name: str) -> None:
    board = Board(firmware=FOLDER / f"{name}.elf")
    for _ in range(100):
        board.run_for(0.0837)
        assert board.chip is not None
        diagnosis = board.chip.diagnosis()
        assert diagnosis is None or not diagnosis.fatal, str(diagnosis)


@pytest.mark.parametrize("name", ["thread_on_spi", "spi_while_blinking"])
def test_inactive_spi_is_reported_after_three_seconds(name: str) -> None:
    """A handler may still ask for a byte, or for a switch to another thread."""
    board = Board(firmware=FOLDER / f"{name}.elf")
    board.run_for(2.9)
    assert board.chip is not None
    assert board.chip.diagnosis() is None

    board.run_for(0.2)

    assert board.chip.diagnosis() is not None


@pytest.mark.parametrize("name", ["spi_direction", "spi_while_blinking", "thread_masked", "thread_on_spi"])
def test_stuck_program_is_reported_inside_handlers_too(name: str) -> None:
    """A verdict must not depend on the end of a run: the last handler is finished in a copy."""
    board = Board(firmware=FOLDER / f"{name}.elf")
    board.run_for(RUN_S[name])
    assert board.chip is not None
    found = set()
    for _ in range(300):
        board.run_for(0.0000041 if board.chip.core.active else 0.000317)
        diagnosis = board.chip.diagnosis()
        found.add(diagnosis.summary if diagnosis is not None else None)

    assert len(found) == 1
    assert None not in found


def test_hardware_wait_of_three_seconds_is_allowed() -> None:
    """The 32 kHz crystal takes up to 2 s to start (STM32F401xB/C datasheet, LSE oscillator)."""
    board = Board(firmware=FOLDER / "poll_for_ever.elf")
    board.run_for(2.9)
    assert board.chip is not None
    assert board.chip.diagnosis() is None

    board.run_for(0.2)

    assert board.chip.diagnosis() is not None


def test_diagnosis_changes_nothing() -> None:
    """The probe works on a copy, so a diagnosed run continues like any other run."""
    looked_at, left_alone = (Board(firmware=FOLDER / "unshifted_address.elf") for _ in range(2))
    for board in (looked_at, left_alone):
        for _ in range(20):
            board.run_for(0.0023)
            if board is looked_at and board.chip is not None:
                board.chip.diagnosis()

    assert looked_at.chip is not None
    assert left_alone.chip is not None
    assert list(looked_at.trace) == list(left_alone.trace)
    cores = looked_at.chip.core, left_alone.chip.core
    assert cores[0].retired == cores[1].retired
    assert bytes(cores[0].ram) == bytes(cores[1].ram)


@pytest.fixture(scope="module")
def rebuilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build some programs from copies of the sources in another folder."""
    root = tmp_path_factory.mktemp("sources")
    shutil.copytree(arm.sources() / "support", root / "firmware_model" / "arm" / "support")
    folder = root / "tests" / "arm" / "broken"
    shutil.copytree(FOLDER, folder, ignore=shutil.ignore_patterns("*.elf"))
    done = subprocess.run(["make", *REBUILT], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@needs_compiler
@pytest.mark.parametrize("name", REBUILT)
def test_rebuilt_programs_have_same_summary(name: str, rebuilt: Path) -> None:
    """Another compiler gives other addresses, but the first line stays the same."""
    summary = diagnosed(name, rebuilt).splitlines()[0]

    assert without_times(summary) == without_times((EXPECTED / f"{name}.txt").read_text().splitlines()[0])
