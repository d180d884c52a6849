"""``fcu new DIR``: a student's project, ready to build with ``fcu build`` or make.

Decision: the project gets its own copy of the support layer, so that it builds without this package, on the
lab's computers and in CubeIDE, and a student can look into everything the chip executes.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import click

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.cli.toolchain import COMPILER, find_compiler
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.system_words import how_to_install, quoted
from fcu_emulator.emulator.text import visible
from fcu_emulator.firmware_model import arm

_SUPPORT = ("*.c", "*.h", "*.ld", "*.mk", "*.options")
_USUAL = FCU001V1.profile()
_PROFILE = {
    profile.bus: "" if profile is _USUAL else f" --profile {profile.name}" for profile in FCU001V1.profiles
}
"""By bus, what ``fcu run`` has to be told."""


def create_project(directory: Path, bus: str) -> None:
    """Write the template into ``directory``, for sensors on ``bus``, and print what to do next.

    Raises InputError if there is already something in it, or it cannot be written.
    """
    try:
        if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
            raise InputError(f"{directory} exists and is not an empty folder; give the name of a new one")
        _write(directory, bus)
    except OSError as error:
        raise InputError(f"cannot create {directory}: {error.strerror or error}") from error
    _say_what_is_next(directory, bus)


def _write(directory: Path, bus: str) -> None:
    sources = arm.sources()
    support = directory / "support"
    support.mkdir(parents=True)
    for pattern in _SUPPORT:
        for file in sorted((sources / "support").glob(pattern)):
            shutil.copyfile(file, support / file.name)
    shutil.copyfile(sources / "template" / "main.c", directory / "main.c")
    shutil.copyfile(sources / "scaffold" / "README.md", directory / "README.md")
    shutil.copyfile(sources / "scaffold" / "gitignore", directory / ".gitignore")
    workflow = directory / ".github" / "workflows" / "lab3.yml"
    workflow.parent.mkdir(parents=True)
    shutil.copyfile(sources / "scaffold" / "workflow.yml", workflow)
    makefile = (sources / "scaffold" / "Makefile").read_text(encoding="utf-8")
    makefile = makefile.replace(f"BUS ?= {_USUAL.bus}", f"BUS ?= {bus}")
    (directory / "Makefile").write_text(makefile, encoding="utf-8", newline="\n")


def _say_what_is_next(directory: Path, bus: str) -> None:
    name, quoted_name = visible(str(directory)), visible(quoted(str(directory)))
    click.echo(f"{name}: the LAB3 template, sensors on {bus}. Your program is main.c. Next:\n")
    click.echo(f"  cd {quoted_name}")
    click.echo("  fcu build")
    click.echo(f"  fcu run lab3.elf{_PROFILE[bus]}")
    click.echo("  fcu check")
    if find_compiler() is None:
        click.echo(f"\n{COMPILER} is not installed: {how_to_install(COMPILER)}")
