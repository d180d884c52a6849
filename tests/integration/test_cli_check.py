"""``fcu check`` for a student: its screen and its exit code."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.firmware_model.arm import prebuilt
from tests.arm.test_agreement_student import solved, write_code
from tests.support.arm import student_programs
from tests.support.words import Words

ROOT = Path(__file__).parents[2]
STUDENT = ROOT / "docs" / "student.md"
QUICK = "--exercise", "2"
SAMPLED = "  ReadSensorRawData(&acc, &gyro, &mag, &press);\n"
"""The line of the template that reads the sensors."""

needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


def fcu(*arguments: str, folder: Path = ROOT, path: str | None = None) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    if path is not None:
        environment["PATH"] = path
    return subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return the project that ``fcu new mylab`` creates."""
    fcu("new", "mylab", folder=tmp_path)
    return tmp_path / "mylab"


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_solution_passes_all_checks() -> None:
    done = fcu("check", "solution", *QUICK, "--exercise", "4")

    assert done.returncode == 0, done.stderr
    assert "  2   done        4 of 4    Altitude from the pressure\n" in done.stdout
    assert commands_of(done.stdout) == [
        ["fcu", "check", "solution"],  # all exercises
        ["fcu", "check", "solution", "--exercise", "2", "--exercise", "4", "--seed", "1"],
    ]
    assert done.stderr == ""


def next_steps(screen: str) -> str:
    """Return the end of a screen: the next steps and the commands."""
    return screen.partition("\nNext\n")[2]


def commands_of(screen: str) -> list[list[str]]:
    """Return the commands at the end of a screen, without the comments after them."""
    lines = next_steps(screen).splitlines()
    return [shlex.split(line, comments=True) for line in lines if line.startswith("    fcu ")]


def line_with(text: str, part: str) -> str:
    """Return the only line of a text that contains ``part``."""
    (line,) = [line for line in text.splitlines() if part in line]
    return line


def test_template_gets_next_steps(tmp_path: Path, words: Words) -> None:
    shutil.copyfile(prebuilt("template", "I2C2"), tmp_path / "lab3.elf")
    done = fcu("check", *QUICK, folder=tmp_path)

    assert done.returncode == 1
    assert "  2   not yet     0 of 4    Altitude from the pressure\n" in done.stdout
    assert "Altitude: %f m" in done.stdout
    assert commands_of(done.stdout) == [
        ["fcu", "check", "--exercise", "2"],
        ["fcu", "check", "--exercise", "2", "--hint"],
        ["fcu", "run", "lab3.elf"],
        ["fcu", "check", "--exercise", "2", "--save", "motions"],
    ]
    words("check", done.stdout.partition("Exercise 2")[2])


def test_next_step_shows_function_to_write() -> None:
    done = fcu("check", "template-arm", "--exercise", "3")

    assert "\nNext\n  Write eCompass() " in done.stdout


def test_printed_command_replays_failed_check(tmp_path: Path) -> None:
    done = fcu("check", "template-arm", *QUICK, "--seed", "7", "--save", "my motions", folder=tmp_path)
    again = commands_of(done.stdout)[-1]
    replayed = fcu(*again[1:], "--speed", "max", folder=tmp_path)

    assert again == ["fcu", "run", "template-arm", "--scenario", "my motions/stairs.toml"]
    assert replayed.returncode == 1
    assert "seed 7" in replayed.stderr
    assert "Altitude: %f m" in replayed.stderr
    assert "158" in replayed.stderr
    assert fcu("run", "solution", *again[3:], "--quiet", folder=tmp_path).returncode == 0


def test_hint_option_shows_one_more_hint(words: Words) -> None:
    """Two checks have one hint at first. Each --hint shows one more hint of the first check, until there are no more."""
    none, two, all_of_them = (
        fcu("check", "template-arm", *QUICK, *["--hint"] * count).stdout for count in (0, 2, 5)
    )

    hints = [re.findall(r"hint(?: \d of \d)?: ", screen) for screen in (none, two, all_of_them)]
    assert hints[0] == ["hint 1 of 4: ", "hint: "]
    assert hints[1] == ["hint 1 of 4: ", "hint 2 of 4: ", "hint 3 of 4: ", "hint: "]
    assert len(hints[2]) == 5
    assert "0.0065" not in two
    assert "0.0065" in all_of_them
    ends = [next_steps(screen) for screen in (none, two, all_of_them)]
    assert "\n    fcu check template-arm --exercise 2 --hint  " in ends[0]
    assert [end.count("--hint") for end in ends] == [1, 3, 0]
    for end in ends:
        words("check", end)


@needs_compiler
def test_next_hint_is_offered_beside_cause(tmp_path: Path, words: Words) -> None:
    """A cause is shown above the checks, together with the hints of the checks."""
    program = student_programs.programs("exercises.toml")["wrong_axis_in_root"]
    elf = str(student_programs.build(program, "Og", tmp_path))
    first, last = (fcu("check", elf, "--exercise", "3", *["--hint"] * count).stdout for count in (0, 3))

    assert "computed as" in first
    words("check", "\n".join(line for line in first.splitlines() if "computed as" in line))
    assert "hint 1 of 3: " in first
    assert " --exercise 3 --hint  " in next_steps(first)
    assert "hint 3 of 3: " in last
    assert "--hint" not in next_steps(last)


@needs_compiler
def test_no_hint_is_announced_while_hints_are_hidden(tmp_path: Path, words: Words) -> None:
    """The lost ticks must be fixed first."""
    program = student_programs.programs("exercises.toml")["short_delay_in_callback"]
    elf = str(student_programs.build(program, "Og", tmp_path))
    done = fcu("check", elf, "--exercise", "1", "--hint").stdout

    words("check", line_with(done, "Exercise 1: fix"))
    assert re.search(r"hint(?: \d of \d)?: |--hint", done) is None
    (told,) = [line for line in next_steps(done).splitlines() if line.lower().startswith("  hint")]
    words("check", told)


def test_check_leaves_no_files_behind(tmp_path: Path) -> None:
    """Hypothesis, which calls getAltitude() with generated numbers, must not leave its folder either."""
    fcu("check", "solution", *QUICK, folder=tmp_path)

    assert list(tmp_path.iterdir()) == []


def test_each_unmet_requirement_is_reported(tmp_path: Path) -> None:
    file = tmp_path / "verdict.json"
    fcu("check", "template-arm", "--exercise", "4", "--json", str(file))
    (led,) = Verdict.from_json(file.read_text(encoding="utf-8")).of("4")

    at_once, later = led.expected.split("; ")
    assert "0.3 s" in at_once
    assert "1.3 s" in later
    assert "1 of 2 points" in later


@needs_compiler
def test_violated_law_is_saved_as_failing_scenario(project: Path, tmp_path: Path) -> None:
    """The pitch is wrong only beyond 83 degrees, which no run of the rubric reaches."""
    code = solved()
    right = "  pitch = pitch * DEGREES;\n"
    assert right in code[0]
    code[0] = code[0].replace(right, f"{right}  if (fabsf(pitch) > 89) pitch = 0;\n")
    write_code(project, code)
    done = fcu("check", "--exercise", "3", "--save", "motions", folder=project)
    line = next(one for one in done.stdout.splitlines() if one.startswith("        run: "))
    command = shlex.split(line.partition("run: ")[2])

    assert fcu(*command[1:], "--speed", "max", "--quiet", folder=project).returncode == 1
    assert fcu("run", "solution", *command[3:], "--quiet", folder=project).returncode == 0


def test_saved_led_scenario_fails_like_check(tmp_path: Path) -> None:
    done = fcu("check", "template-arm", "--exercise", "4", "--save", "motions", folder=tmp_path)
    saved = ["--scenario", "motions/steep_y.toml", "--speed", "max", "--quiet"]

    assert next_steps(done.stdout).splitlines()[-1].startswith("    fcu run ")  # no restriction is told
    assert fcu("run", "template-arm", *saved, folder=tmp_path).returncode == 1
    assert fcu("run", "solution", *saved, folder=tmp_path).returncode == 0


def test_check_output_fits_one_screen(tmp_path: Path) -> None:
    done = fcu("check", "template-arm")

    lines = done.stdout.splitlines()
    shown = re.search(r"```text\n(LAB3: .*?)```", STUDENT.read_text(encoding="utf-8"), re.DOTALL)
    assert shown is not None
    assert done.stdout.startswith(shown[1].replace("lab3.elf", "template-arm"))
    assert len(lines) <= 32
    assert max(map(len, lines)) <= 98


def test_missing_hypothesis_package_is_reported(tmp_path: Path) -> None:
    missing = tmp_path / "hypothesis"
    missing.mkdir()
    (missing / "__init__.py").write_text("raise ModuleNotFoundError('no', name='hypothesis')")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from fcu_emulator.emulator.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "check", "solution", *QUICK],
        cwd=ROOT,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )

    assert done.returncode == 0
    assert "hypothesis is not installed" in done.stdout


def test_verdict_is_written_as_json(tmp_path: Path) -> None:
    file = tmp_path / "verdict.json"
    fcu("check", "lab3", *QUICK, "--seed", "7", "--json", str(file))
    verdict = Verdict.from_json(file.read_text(encoding="utf-8"))

    assert (verdict.seed, verdict.points, verdict.max_points) == (7, 4.0, 4.0)


@needs_compiler
def test_folder_is_built_and_warning_printed(project: Path, words: Words) -> None:
    change(project / "main.c", "int main(void)\n{\n", "int main(void)\n{\n  int unused;\n")
    first, second = fcu("check", str(project), "-e", "1"), fcu("check", str(project), "-e", "1")

    assert first.returncode == 0, first.stderr
    ungraded = first.stdout.partition("Not graded\n")[2].splitlines()
    assert "main.c:" in ungraded[2]
    words("check", "\n".join((*ungraded[:2], *ungraded[-4:])))
    assert first.stdout == second.stdout


@needs_compiler
def test_failed_build_is_not_judged(project: Path, words: Words) -> None:
    change(project / "main.c", "int main(void)\n{\n", "int main(void)\n{\n  pitch = 0;\n")
    done = fcu("check", str(project))

    assert done.returncode == 2
    assert done.stdout == ""
    first, second, *_, last = done.stderr.splitlines()
    assert second.startswith("fcu:   main.c:")
    assert last.endswith(f": fcu check {project}")
    words("check", f"{first}\n{last}")


@needs_compiler
def test_misspelt_function_is_reported_with_its_line(project: Path) -> None:
    """The compiler only warns about it, and the linker's last line only says that something failed."""
    change(project / "main.c", "    HAL_Delay(1000);", "    HAL_delay(1000);")
    line = 1 + (project / "main.c").read_text(encoding="utf-8").split("HAL_delay")[0].count("\n")
    done = fcu("check", str(project))

    assert done.returncode == 2
    assert f"fcu:   main.c:{line}: " in line_with(done.stderr, "`HAL_delay'")
    assert "collect2" not in done.stderr


@needs_compiler
def test_crash_is_explained_by_its_line(project: Path, words: Words) -> None:
    change(project / "main.c", SAMPLED, f"{SAMPLED}  *(volatile int *)0x60000000 = 1;\n")
    done = fcu("check", str(project), "-e", "1")

    assert done.returncode == 3
    before, _, _ = done.stdout.partition("\n  HardFault at ")
    assert before != done.stdout
    words("check", before.splitlines()[-1])
    assert "HAL_TIM_PeriodElapsedCallback(), main.c:" in done.stdout


@needs_compiler
def test_starving_callback_is_printed_before_hints(project: Path, words: Words) -> None:
    change(project / "main.c", SAMPLED, f'{SAMPLED}  PRINTF("sampled\\n");\n')
    done = fcu("check", str(project), "-e", "2")
    head, _, rest = done.stdout.partition("Exercise 2: ")

    assert done.returncode == 1, done.stderr
    assert "  2   not yet     0 of 4    Altitude from the pressure\n" in head
    first, cause, *_ = rest.splitlines()
    assert cause.startswith("  HAL_TIM_PeriodElapsedCallback() ")
    assert "PRINTF() in HAL_TIM_PeriodElapsedCallback(), main.c:" in rest
    check = next(line for line in rest.splitlines() if line.startswith("  FAIL  "))
    before_check = rest.partition(check)[0].splitlines()[-1]
    assert "hint:" not in rest
    words("check", "\n".join((first, before_check, check, next_steps(rest).splitlines()[0])))


@pytest.mark.parametrize(
    "arguments",
    [
        ("nowhere.elf",),
        ("lab3", "--exercise", "9"),
        ("lab3", "--rubric", "lab4"),
        (".",),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(
    tmp_path: Path, arguments: tuple[str, ...], words: Words
) -> None:
    done = fcu("check", *arguments, folder=tmp_path)

    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    words("check", done.stderr)


def test_missing_make_and_compiler_are_reported(project: Path, tmp_path: Path) -> None:
    done = fcu("check", str(project), path=str(tmp_path))

    assert done.returncode == 2
    assert done.stderr.startswith("fcu: arm-none-eabi-gcc is not installed: ")


def test_rubric_command_checks_file_and_prints_schema(tmp_path: Path, words: Words) -> None:
    checked = fcu("rubric", "check", str(ROOT / "scenarios" / "rubrics" / "lab3.toml"))
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("schema = 1\ntitel = 1\n", encoding="utf-8")

    assert checked.returncode == 0
    words("rubric", checked.stdout.splitlines()[0])
    words("rubric", fcu("rubric", "check", str(wrong)).stderr)
    assert '"title": "fcu-emulator rubric, schema 1"' in fcu("rubric", "schema").stdout


@pytest.mark.parametrize("program", ["solution", "template-arm", "lab3"])
def test_parallel_runs_give_same_output(program: str, tmp_path: Path) -> None:
    outputs = []
    for jobs in ("1", "3"):
        file = tmp_path / f"{jobs}.json"
        done = fcu(
            "check", program, "--exercise", "1", "--exercise", "4", "--jobs", jobs, "--json", str(file)
        )
        outputs.append((done.returncode, done.stdout, file.read_text(encoding="utf-8")))

    assert outputs[0] == outputs[1]


def test_parallel_and_single_jobs_print_same_refusal(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.elf"
    wrong.write_bytes(b"\x7fELF" + bytes(100))
    outputs = [fcu("check", str(wrong), "--jobs", jobs) for jobs in ("1", "3")]

    assert [one.returncode for one in outputs] == [2, 2]
    assert outputs[0].stderr == outputs[1].stderr
