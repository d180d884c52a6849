"""The pytest plugin for its users: tests are written into a folder and run with pytest."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import fcu_emulator.emulator.assembly.board  # noqa: F401  # numpy can be loaded once, and pytester forgets what its runs load
from tests.support.arm import student_programs
from tests.support.arm.broken_programs import FOLDER
from tests.support.words import Words

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[2]
ARGUMENTS = ("-p", "no:cacheprovider", "-p", "no:xdist", "-q")


@pytest.fixture(autouse=True)
def plain(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nfilterwarnings = error\n")


def test_fixtures_provide_board_and_serial_line(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        def test_default(board, dut):
            assert board.booted.name == "lab3"
            dut.expect_exact("LAB3 Init...")
            match = dut.expect(r"ACC.x,y,z. (-?\\d+) mg")
            assert abs(int(match[1])) < 100
            assert board.now_s < 3

        @pytest.mark.board("solution", ideal=True, seed=3)
        def test_marker(board, dut):
            assert (board.booted.name, board.seed) == ("solution", 3)
            dut.expect_all([r"Altitude: ", r"Pitch: "])
            dut.not_matching("nan", timeout=2)

        @pytest.mark.board(scenario="flat")
        def test_scenario(board):
            assert board.scenario.name == "flat"

        @pytest.mark.parametrize("firmware", ["lab3", "template"])
        def test_each(board, dut, firmware):
            dut.expect(["nothing like it", "Pre: "])
            assert board.booted.name == firmware

        @pytest.mark.board(None)
        def test_none(board):
            assert board.i2c2.write_read(0x6B, b"\\x0f", 1) == b"\\x6a"
        """
    )
    pytester.runpytest_inprocess(*ARGUMENTS).assert_outcomes(passed=6)


def test_firmware_option_overrides_marker(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.board("lab3")
        def test_it(board, firmware):
            assert firmware == board.booted.name == "template"
        """
    )
    pytester.runpytest_inprocess(*ARGUMENTS, "--firmware", "template").assert_outcomes(passed=1)


@pytest.mark.parametrize(
    "call",
    [
        'dut.expect("never so", timeout=0.5)',
        'dut.expect_exact("a.b", timeout=0.1)',
        'dut.expect_all(["LAB3", "not this"], timeout=2)',
        'dut.expect(["one", "two"], timeout=0.1)',
        'dut.not_matching("LAB.", timeout=2)',
        'dut.expect("Pre:", 4, not_matching="ACC")',
    ],
)
def test_failure_shows_expected_text_without_internal_frames(
    call: str, words: Words, pytester: pytest.Pytester
) -> None:
    pytester.makepyfile(f"def test_it(dut):\n    {call}\n")
    result = pytester.runpytest_inprocess(*ARGUMENTS)
    result.assert_outcomes(failed=1)
    printed = result.stdout.str()

    (failure,) = [line for line in printed.splitlines() if line.startswith("E ")]
    words("pytest", failure)
    assert "plugin.py" not in printed.partition("Captured stdout")[0]


def test_failure_shows_board_output(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.board("solution", seed=2)
        def test_it(board, dut):
            dut.expect("Pre: ")
            assert board.now_s == 0
        """
    )
    result = pytester.runpytest_inprocess(*ARGUMENTS, "--junit-xml=out.xml", "-o", "junit_logging=system-out")
    printed = result.stdout.str()

    assert "Captured stdout: terminal at " in printed
    assert "LAB3 Init..." in printed
    assert re.search(r"Captured stdout: transfers before \d\.\d{3} s, ", printed)
    assert "I2C2 LPS22HB " in printed
    assert "fcu run solution --wiring lab3 --seed 2 --duration " in printed
    system_out = ET.parse(pytester.path / "out.xml").find(".//system-out")
    assert system_out is not None
    assert "LAB3 Init..." in (system_out.text or "")


def run_printed_command(printed: str, folder: Path) -> subprocess.CompletedProcess[bytes]:
    """Run the command that a failed test has printed."""
    command = next(line for line in printed.splitlines() if line.startswith("fcu run solution "))
    return subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *shlex.split(command)[1:], "--quiet"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
    )


def test_printed_command_keeps_cold_start(pytester: pytest.Pytester) -> None:
    """The solution does not wait for its sensors, so on such a board it does not continue."""
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.board("solution", cold_start=True)
        def test_it(board):
            board.run_for(0.5)
            assert False
        """
    )
    done = run_printed_command(pytester.runpytest_inprocess(*ARGUMENTS).stdout.str(), pytester.path)

    assert done.returncode == 3


def test_printed_command_repeats_test(pytester: pytest.Pytester) -> None:
    """The bytes are the same with setters, motions planned ahead, typing, faults, iron, and steps of a scenario."""
    step = '[[timeline]]\ndo = "set_attitude"\nat = "1s"\nroll_deg = 9\n'
    scenario = f'schema = 1\nquestion = "q"\nduration = "9s"\n{step}'
    (pytester.path / "own.toml").write_text(scenario, encoding="utf-8")
    pytester.makepyfile(
        """
        import pytest
        from fcu_emulator import I2CFault
        from pathlib import Path

        @pytest.mark.board("solution", seed=5, scenario="own.toml")
        def test_it(board, dut):
            board.world.set_hard_iron(90, -30, 10)
            board.world.set_attitude(0, 40, 0)
            board.run_for(1.2003)
            board.world.rotate_to(roll_deg=0, pitch_deg=70, yaw_deg=20, duration_s=0.5)
            board.world.lift(2, 0.7, start_s=1.9)
            board.world.set_magnetic_field(21, 1, 42)
            dut.write("hello")
            board.i2c2.inject(I2CFault("nack", 2.5, 2.6))
            board.run_for(2)
            board.world.change_pressure(2, 1)
            board.run_for(1.5)
            Path("seen.txt").write_bytes(board.terminal.text.encode("latin-1"))
            assert False
        """
    )
    printed = pytester.runpytest_inprocess(*ARGUMENTS).stdout.str()
    done = run_printed_command(printed, pytester.path)

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith((pytester.path / "seen.txt").read_bytes())
    assert "It does not contain: " not in printed


def test_unrepeatable_actions_are_listed(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.board("solution")
        def test_it(board):
            board.run_for(1.2)
            board.set_variable("press_zero_level", 900.0)
            board.world.set_gravity(5)
            board.i2c2.write_read(0x6B, b"\\x0f", 1)
            board.i2c2.write_read(0x6B, b"\\x0f", 1)
            board.call("getAltitude", 950.0, 20.0)
            with board.scratch() as copy:
                copy.call("eCompass")
            assert False
        """
    )
    printed = pytester.runpytest_inprocess(*ARGUMENTS).stdout.str()

    missing = next(line for line in printed.splitlines() if line.startswith("It does not contain: "))
    assert missing == (
        "It does not contain: board.set_variable; board.world.set_gravity; board.i2c2.write_read, 2 times."
    )


def test_firmware_without_name_gets_no_command(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        "import pytest\n\n@pytest.mark.board(None)\ndef test_it(board):\n    assert board.now_s\n"
    )
    printed = pytester.runpytest_inprocess(*ARGUMENTS).stdout.str()

    assert "no command: " in printed
    assert "fcu run --" not in printed


def test_hang_is_diagnosed(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_it(dut):\n    dut.expect('Pitch', timeout=1)\n")
    result = pytester.runpytest_inprocess(*ARGUMENTS, "--firmware", str(FOLDER / "null_pointer.elf"))

    assert "Captured stdout: diagnosis" in result.stdout.str()
    assert "null_pointer.c" in result.stdout.str()


def test_plugin_works_with_several_processes(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.parametrize("number", range(4))
        def test_it(board, dut, number):
            dut.expect("LAB3")
        """
    )
    pytester.runpytest_subprocess("-p", "no:cacheprovider", "-q", "-n", "2").assert_outcomes(passed=4)


def test_wrong_arguments_are_refused_in_one_line(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_it(board):\n    pass\n")
    result = pytester.runpytest_inprocess(*ARGUMENTS, "--firmware", "nowhere.elf")

    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["nowhere.elf: does not exist*"])
    assert "plugin.py" not in result.stdout.str()


def test_misspelt_marker_causes_one_line_error(pytester: pytest.Pytester, words: Words) -> None:
    marked = "@pytest.mark.board(sceanrio='desk')\ndef test_it(board):\n    pass\n"
    pytester.makepyfile(f"import pytest\n\n{marked}")
    result = pytester.runpytest_inprocess(*ARGUMENTS)

    result.assert_outcomes(errors=1)
    (told,) = [line for line in result.outlines if "'sceanrio'" in line and "ERROR" not in line]
    words("pytest", told)
    assert "plugin.py" not in result.stdout.str()


def test_printed_command_uses_same_board(pytester: pytest.Pytester) -> None:
    """On a board without noise, the text has one line for each line that a terminal shows."""
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.board("template", ideal=True)
        def test_it(board, dut):
            dut.expect("Pre: .*hPa .*")
            assert False
        """
    )
    printed = pytester.runpytest_inprocess(*ARGUMENTS).stdout.str()

    assert "fcu run template --wiring lab3 --seed 0 --ideal --duration " in printed
    assert "ACC[x,y,z] 0 mg 0 mg 1000 mg \nGYR[x,y,z] 0 mdps 0 mdps 0 mdps \n" in printed


@pytest.mark.skipif(not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed")
def test_failure_shows_wrong_formula_with_line(pytester: pytest.Pytester) -> None:
    change = student_programs.Change("main.c", "bx * cosf(pitch)", "bx * cosf(roll)")
    elf = student_programs.build(student_programs.Program("formula", "", (change,)), "O2", pytester.path)
    pytester.makepyfile(
        f"""
        import pytest

        @pytest.mark.board({str(elf)!r}, ideal=True)
        def test_yaw(board, dut):
            board.run_for(1)
            assert False
        """
    )
    result = pytester.runpytest_inprocess(*ARGUMENTS)

    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*main.c:*Bx*cos(roll) + Bz2*sin(pitch)*"])
