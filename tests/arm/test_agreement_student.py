"""The student's way through the lab in C, step by step: fcu new, edit main.c, make, fcu run, fcu diff."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from fcu_emulator.firmware_model import arm
from tests.integration.test_cli import fcu

pytestmark = pytest.mark.skipif(
    shutil.which("arm-none-eabi-gcc") is None or shutil.which("make") is None,
    reason="arm-none-eabi-gcc or make is not installed",
)

PAGE = Path(__file__).parents[2] / "docs" / "arm-firmware.md"
PLACE = re.compile(r"^ */\* YOUR CODE HERE: .* \*/\n", re.MULTILINE)

SHORT = ("--duration", "1200ms")  # boot takes 1.06 s: one block is printed

FUNCTIONS, LOOP, CALLBACK = range(3)  # the places, in their order in main.c

PRINT_PLOT = r"""
    alt = getAltitude(press, temperature);
    PRINTF("*****\n\r\n\r");
    PRINTF("Pitch: %f deg Roll: %f deg Yaw: %f deg \n\r", pitch, roll, azimuth);
    PRINTF("Altitude: %f m \n\r", alt);
    PRINTF("*****\n\r\n\r");
"""
EVERY_SAMPLE = """
  MagCalibration();
  eCompass();
  Show(LED1, pitch);
  Show(LED2, roll);
"""
BLINKING = "    BSP_LED_Toggle(LED1);\n    BSP_LED_Toggle(LED2);\n"


def start(folder: Path, bus: str = "I2C2") -> Path:
    fcu("new", str(folder), "--bus", bus)
    return folder


def write_code(project: Path, code: dict[int, str]) -> None:
    """Put code into the marked places of main.c, and leave the other places unchanged."""
    main = project / "main.c"
    places = iter(range(3))
    text = PLACE.sub(lambda place: code.get(next(places), place.group()), main.read_text())
    assert next(places, None) is None, "the template has three places for code"
    main.write_text(text)


def make(project: Path) -> Path:
    done = subprocess.run(["make"], cwd=project, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "", "a warning"
    return project / "lab3.elf"


def solved() -> dict[int, str]:
    """Return the code of the exercises in the solution, for the places in the template."""
    solution = arm.sources() / "solution"
    motion = re.sub(r"^#include.*\n", "", (solution / "motion.c").read_text(), flags=re.MULTILINE)
    main = (solution / "main.c").read_text()
    show = main[main.index("static void Show") : main.index("int main(void)")]
    functions = f"#include <stdbool.h>\n#define LED_THRESHOLD_DEG 80\nfloat alt;\n{motion}\n{show}"
    return {FUNCTIONS: functions, LOOP: PRINT_PLOT, CALLBACK: EVERY_SAMPLE}


def page_code() -> list[str]:
    return re.findall(r"^```c\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def test_exercises_in_c_equal_python_firmware(tmp_path: Path) -> None:
    project = start(tmp_path / "mylab")
    write_code(project, solved())
    main = project / "main.c"
    main.write_text(main.read_text().replace(BLINKING, ""))
    elf = str(make(project))

    verdict = fcu("run", elf, "--scenario", "desk", "--speed", "max").stderr.decode()
    assert "8 of 8 expectations met" in verdict
    for scenario, how in (("desk", ()), ("flat", ("--replay",))):
        text = fcu("diff", "lab3", elf, "--scenario", scenario, *SHORT, *how).stdout.decode()
        assert text.endswith("no difference in 1.2 s\n")


def test_negative_zero_and_rounding_error_are_not_differences(tmp_path: Path) -> None:
    """The guide has this command. A pitch of zero is -0.000000. The yaw differs by less than the error of float."""
    code = solved()
    for right, other in {
        "minus_gx = -acc.AXIS_X": "minus_gx = -(double)acc.AXIS_X",
        "azimuth = azimuth * DEGREES;": "azimuth = azimuth * DEGREES + 0.005f;",
    }.items():
        assert right in code[FUNCTIONS]
        code[FUNCTIONS] = code[FUNCTIONS].replace(right, other)
    project = start(tmp_path / "mylab")
    write_code(project, code)
    main = project / "main.c"
    main.write_text(main.read_text().replace(BLINKING, ""))
    command = "diff", "lab3", str(make(project)), "--scenario", "tilt_sweep", "--replay", "--duration", "9s"

    for options in ((), ("--tolerance", "ACC=2")):
        assert fcu(*command, *options).stdout.decode().endswith("no difference in 9 s\n")


def test_unchanged_template_differs_from_solution(tmp_path: Path) -> None:
    elf = str(make(start(tmp_path / "mylab")))

    text = fcu("diff", "lab3", elf, "--scenario", "desk", *SHORT, code=1).stdout.decode()
    assert "LSM6DSL registers: the same, 20 and 20 entries" in text
    assert "first difference, terminal, entry 14: different text" in text


def test_arithmetic_mistake_is_shown_as_first_difference(tmp_path: Path) -> None:
    """The sign of Gx in the pitch is wrong, and all other code is correct."""
    code = solved()
    assert "minus_gx = -acc.AXIS_X" in code[FUNCTIONS]
    code[FUNCTIONS] = code[FUNCTIONS].replace("minus_gx = -acc.AXIS_X", "minus_gx = acc.AXIS_X")
    project = start(tmp_path / "mylab")
    write_code(project, code)
    elf = str(make(project))

    text = fcu("diff", "lab3", elf, "--scenario", "desk", *SHORT, code=1).stdout.decode()
    assert "first difference, terminal" in text
    assert r"\rPitch: -2.498770 deg Roll: 1.305874 deg Yaw: 0.000000 deg \n" in text
    assert r"\rPitch: 2.498770 deg Roll: 1.305874 deg Yaw: 0.000000 deg \n" in text


def test_example_in_guide_prints_acceleration(tmp_path: Path) -> None:
    functions, loop = page_code()
    project = start(tmp_path / "mylab")
    write_code(project, {FUNCTIONS: functions, LOOP: loop})

    text = fcu("run", str(make(project)), "--ideal", "--speed", "max", *SHORT).stdout.decode()
    assert text.count("Acceleration: 1000.000000 mg") == 1


def test_project_for_spi2_gets_wiring_with_spi2(tmp_path: Path) -> None:
    elf = make(start(tmp_path / "mylab", "SPI2"))

    done = fcu("run", str(elf), "--speed", "max", *SHORT)
    assert "board fcu001v1" in done.stderr.decode()
    assert "ACC[x,y,z] " in done.stdout.decode()
