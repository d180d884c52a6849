"""Programs in the vendor's calling style: the files are current builds, and the programs work."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.firmware_model import arm
from tests.arm.test_firmware_build import compiler_of, needs_compiler
from tests.support.arm.recording import chip_state
from tests.support.arm.vendor_programs import VENDOR, file, laps_line, numbers

CCR = ("34", "38", "3C", "40")
PROGRAMS = sorted(path.stem for path in VENDOR.glob("*.elf"))


def board(name: str, wiring: str = "lab3") -> Board:
    return Board(file(name), wiring=wiring, ideal=True)


@pytest.fixture(scope="module")
def rebuilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build all programs from copies of the sources in another folder."""
    root = tmp_path_factory.mktemp("sources")
    shutil.copytree(arm.sources() / "support", root / "firmware_model" / "arm" / "support")
    folder = root / "tests" / "arm" / "vendor"
    shutil.copytree(VENDOR, folder, ignore=shutil.ignore_patterns("*.elf", ".objects"))
    done = subprocess.run(["make", "-j2"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@needs_compiler
@pytest.mark.parametrize("name", PROGRAMS)
def test_stored_file_equals_fresh_build(name: str, rebuilt: Path) -> None:
    built, kept = rebuilt / f"{name}.elf", file(name)
    if compiler_of(built) != compiler_of(kept):
        pytest.skip(f"another compiler: {compiler_of(built)}, not {compiler_of(kept)}")

    assert built.read_bytes() == kept.read_bytes()


def test_every_program_has_stored_file() -> None:
    makefile = (VENDOR / "Makefile").read_text()
    named = re.findall(r"^(?:LAB|PROGRAMS) := (.*)$", makefile, re.MULTILINE)

    assert set(" ".join(named).replace("$(LAB)", "").split()) == set(PROGRAMS)


@pytest.mark.parametrize("way", ["polled", "it", "dma"])
def test_sensors_are_read_in_every_way(way: str) -> None:
    one = board(f"lab3_i2c_{way}")
    one.run_for(1.25)
    last_block = one.terminal.text.rsplit("*****", 1)[1]

    assert "Pre: 965.179993 hPa" in last_block
    assert "MAG[x,y,z] 214 mg 0 mg -430 mg" in last_block
    assert numbers("Errors", last_block) == [0]
    assert (one.tim9.late, one.tim9.lost) == (0, 0)


@pytest.mark.parametrize(("way", "back"), [("it", "HELLO, BOARD"), ("dma", "draoB ,olleH")])
def test_typed_text_is_echoed(way: str, back: str) -> None:
    one = board(f"uart_{way}")
    one.run_for(0.05)
    one.terminal.write("Hello, Board")
    one.run_for(0.06)

    assert one.terminal.text.startswith(back)
    assert ", 0 errors" in one.terminal.text


def test_flight_controller_sets_expected_motor_outputs() -> None:
    one = board("flight", "fcu001v1")
    one.run_for(1.09)

    timers = {name: chip_state(one).blocks[name] for name in ("TIM2", "TIM4")}
    compare = {name: [int(registers[offset], 16) for offset in CCR] for name, registers in timers.items()}

    assert one.tim9.ticks > 20
    assert (one.tim9.late, one.tim9.lost) == (0, 0)
    assert compare == {"TIM2": [800] * 4, "TIM4": [1000, 1100, 1200, 1300]}


def test_firmware_computes_while_it_polls_registers() -> None:
    one = board("all_blocks")
    one.run_for(0.04)

    assert one.terminal.text.startswith(laps_line(32))


def test_threads_read_compute_and_print() -> None:
    one = board("threads")
    one.run_for(0.15)
    lines = one.terminal.text.splitlines()[:-1]  # the last one may be under way

    assert len(lines) >= 5
    assert all(" z 1000 root 1.41421 answer " in line for line in lines)
    assert numbers("answer", "".join(lines)) == list(range(1001, 1001 + len(lines)))
    assert numbers("reads", lines[-1])[0] > 25


def test_interrupts_come_at_timer_rate() -> None:
    """TIM10 comes every 737 us, TIM11 every 911 us, TIM4 with ten flags in 998 us. Each pass also copies by DMA."""
    one = board("events")
    one.run_for(0.07)
    lines = one.terminal.text.splitlines()[:3]
    plain = [[int(number) for number in re.search(r"plain (\d+) (\d+)", line).groups()] for line in lines]
    centre, edges, pulses, copied, exchanged = (
        numbers(name, "\n".join(lines)) for name in ("centre", "edges", "pulses", "copied", "exchanged")
    )

    assert (edges, pulses) == ([0, 0, 0], [10, 20, 30])
    assert (copied, exchanged) == ([6, 12, 18], [16, 32, 48])
    assert (plain[2][0] - plain[0][0]) * 737 == pytest.approx((plain[2][1] - plain[0][1]) * 911, abs=911)
    assert (plain[2][0] - plain[0][0]) * 737 == pytest.approx((centre[2] - centre[0]) * 99.8, abs=1000)
