"""``fcu new DIR``: create a student's project.

Decision: the project gets a copy of the support layer, so that it builds without this package.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

import click

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.cli.project import shown_exercises
from fcu_emulator.emulator.cli.toolchain import COMPILER, find_compiler
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.rubric import PROJECT_RUBRIC, ExerciseTable, Rubric, load_rubric
from fcu_emulator.emulator.grading.trials import lines_of
from fcu_emulator.emulator.host.install_hints import how_to_install, quoted
from fcu_emulator.emulator.text import visible
from fcu_emulator.firmware_model import arm

_SUPPORT = ("*.c", "*.h", "*.ld", "*.mk", "*.options")
_USUAL = FCU001V1.wiring()
_WORKFLOW = "lab3"
_EDITOR_FILES = {
    "Dockerfile": ".devcontainer",
    "devcontainer.json": ".devcontainer",
    "tasks.json": ".vscode",
    "launch.json": ".vscode",
}
"""Files for Visual Studio Code and dev containers, with their folders."""
_MARKDOWN = re.compile(r"[\\`*_{}\[\]<>#|&]")


def create_project(directory: Path, bus: str, rubric: str | None = None) -> None:
    """Write the template into ``directory``, and print the next steps.

    The rubric is copied with the files that it names. Raises InputError if the directory is not
    empty or cannot be written.
    """
    lab = None if rubric is None else load_rubric(rubric)
    beside = [] if lab is None else lab.files()
    try:
        if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
            raise InputError(f"the folder {directory} must be new or empty; give another name")
        _write(directory, bus, lab)
        if lab is not None:
            _copy_rubric(lab, beside, directory)
    except OSError as error:
        raise InputError(f"cannot create {directory}: {error.strerror or error}") from error
    _say_what_is_next(directory, bus, "LAB3" if lab is None else lab.title)


def _copy_rubric(rubric: Rubric, beside: Sequence[Path], directory: Path) -> None:
    """Copy the rubric, and the files ``beside`` it, to the places that ``fcu check`` expects."""
    for name in beside:
        target = directory / name
        if target.exists():
            raise InputError(f"the rubric names {name}, which is a file of the template; rename it")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(rubric.path.parent / name, target)
    shutil.copyfile(rubric.path, directory / PROJECT_RUBRIC)


def _write(directory: Path, bus: str, lab: Rubric | None) -> None:
    sources = arm.sources()
    scaffold = sources / "scaffold"
    support = directory / "support"
    support.mkdir(parents=True)
    for pattern in _SUPPORT:
        for file in sorted((sources / "support").glob(pattern)):
            shutil.copyfile(file, support / file.name)
    if lab is None:
        shutil.copyfile(sources / "template" / "main.c", directory / "main.c")
    else:
        _write_text(directory / "main.c", main_of(lab))
    shutil.copyfile(scaffold / "gitignore", directory / ".gitignore")
    readme = (scaffold / "README.md").read_text(encoding="utf-8") if lab is None else readme_of(lab)
    readme += (scaffold / "README-board.md").read_text(encoding="utf-8")
    _write_text(directory / "README.md", readme)
    workflow = (scaffold / "workflow.yml").read_text(encoding="utf-8")
    name = _WORKFLOW
    if lab is not None:
        workflow, name = workflow_of(lab, workflow), "check"
    _write_text(directory / ".github" / "workflows" / f"{name}.yml", workflow)
    for name, place in _EDITOR_FILES.items():
        _write_text(directory / place / name, (scaffold / name).read_text(encoding="utf-8"))
    makefile = (scaffold / "Makefile").read_text(encoding="utf-8")
    makefile = makefile.replace(f"BUS ?= {_USUAL.bus}", f"BUS ?= {bus}")
    _write_text(directory / "Makefile", makefile)


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def main_of(rubric: Rubric) -> str:
    """Return main.c. The program prints the start-up line of LAB3 if the rubric expects this line."""
    if arm.BOOT_LINE in lines_of(rubric):
        return arm.template_of(rubric.title, arm.BOOT_LINE)
    return arm.template_of(rubric.title)


def readme_of(rubric: Rubric) -> str:
    """Return the first part of README.md for a rubric."""
    exercises = shown_exercises(rubric)
    rows = "".join(
        f"| {one.id} | {_markdown(one.title)} | {_points(one)} | `fcu check --exercise {one.id}` |\n"
        for one in exercises
    )
    return f"""\
# {_markdown(rubric.title)}

Your program is `main.c`; the places for your code are marked `YOUR CODE HERE`. `support/` has the drivers of the
three sensors, the HAL, the start-up code and the linker script; read and call them.

```
fcu build && fcu run lab3.elf   # builds and runs it on the virtual board; Ctrl-C ends
fcu check                       # builds it, shows completed exercises and the next step
fcu check --boards 5            # checks it on five boards and motions
fcu web lab3.elf                # shows the board in the browser, with the exercises
```

`fcu check` uses the rubric `{PROJECT_RUBRIC}` in this folder.

## Exercises
| exercise | title | points | check |
|---|---|---|---|
{rows}
"""


def _points(exercise: ExerciseTable) -> str:
    return f"{sum(check.points for check in exercise.check if check.visible == 'always'):g}"


def workflow_of(rubric: Rubric, usual: str) -> str:
    """Adapt the LAB3 workflow ``usual`` to a rubric."""
    names = [one.id for one in shown_exercises(rubric)]
    text = usual.replace(f"name: {_WORKFLOW}\n", "name: check\n")
    if not names:
        return text.replace("fcu check --exercise 1 ", "fcu check ")
    text = text.replace("fcu check --exercise 1 ", f"fcu check --exercise {names[0]} ")
    if len(names) > 1:
        return text.replace(
            "--exercise 2 when exercise 2 is", f"--exercise {names[1]} when exercise {names[1]} is"
        )
    return text.replace("add --exercise 2 when exercise 2 is done. ", "")


def _markdown(text: str) -> str:
    return _MARKDOWN.sub(r"\\\g<0>", text)


def _say_what_is_next(directory: Path, bus: str, lab: str) -> None:
    name, quoted_name = visible(str(directory)), visible(quoted(str(directory)))
    click.echo(f"{name}: the {visible(lab)} template, sensors on {bus}. Your program is main.c. Next:\n")
    click.echo(f"  cd {quoted_name}")
    click.echo("  fcu build")
    click.echo("  fcu run lab3.elf")
    click.echo("  fcu check")
    if find_compiler() is None:
        click.echo(f"\n{COMPILER} is not installed: {how_to_install(COMPILER)}")
