"""``fcu build``: build a project of ``fcu new`` without make, with an identical result.

Decision: the program's own files are compiled in every build, because the compiler's warnings must
appear. Files of ``support/`` are compiled only after a change.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import click

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.cli.screen import WIDTH, ProgressLine, paint
from fcu_emulator.emulator.cli.toolchain import COMPILER, find_compiler
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.host.install_hints import command_line, how_to_install
from fcu_emulator.emulator.text import visible

ELF = "lab3.elf"
_BUSES = [wiring.bus for wiring in FCU001V1.wirings]
"""Possible buses, the default first."""
_BUILD_S = 300.0
_LONGEST_LOG = 1 << 20
_ERRORS_SHOWN = 3  # errors of the compiler
_MARKS = (
    re.compile("undefined reference|multiple definition|overflowed by"),  # collect2's "error:" has no details
    re.compile("error:"),
    re.compile("Error "),
)
"""Patterns of important lines. Only lines of the first pattern with a match are shown."""
_OPTIONS = ("cpu.options", "compile.options", "link.options")
_ASSIGNMENT = re.compile(r"(?m)^(BUS|OPT|EXTRA_CFLAGS|PREFIX)[ \t]*[?:]?=[ \t]*(.*?)[ \t]*$")


class ProjectBuildError(InputError):
    """A project does not build. The text has the compiler's first errors."""

    has_lines = True


class BuildError(Exception):
    """The compiler failed. ``log`` is its output."""

    def __init__(self, log: str) -> None:
        super().__init__(log)
        self.log = log


def build_and_say(folder: Path) -> None:
    """Build the project, and print warnings and the file's name. Raises InputError."""
    with ProgressLine(f"building {folder}"):
        log = build_project(folder)
    if log:
        click.echo(visible(log, lines=True), err=True)
    click.echo(f"{paint('built', 'pass')} {visible(str(folder / ELF))}")


def build_project(folder: Path, command: str = "build") -> str:
    """Build ``lab3.elf`` and return the compiler's output; errors contain ``command``. Raises
    InputError.
    """
    if not (folder / "Makefile").exists():
        raise InputError(f"the folder {folder} must be a project of `fcu new`, with a Makefile")
    try:
        return _Build(folder).run()
    except BuildError as error:
        raise ProjectBuildError(_build_failed(folder, error.log, command)) from error


def build_with_make(folder: Path, command: str) -> str:
    """Build any project with a Makefile, and return make's output."""
    sources = sorted(path.name for path in folder.glob("*.c"))
    changed = [argument for name in sources for argument in ("-W", name)]
    compiler = find_compiler()
    prefix = [] if compiler is None or shutil.which(COMPILER) else [f"PREFIX={_prefix(compiler)}"]
    code, log = _run(["make", *changed, *prefix], folder)
    if code:
        raise ProjectBuildError(_build_failed(folder, log, command))
    return log


def _run(command: Sequence[str], folder: Path) -> tuple[int, str]:
    """Return exit code and output. Raises InputError if the command cannot run or takes too long."""
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=_BUILD_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{folder}: {command[0]} did not end within {_BUILD_S:g} s") from error
    except OSError as error:
        raise InputError(f"cannot run {command[0]}: {error.strerror or error}") from error
    return done.returncode, done.stdout[:_LONGEST_LOG].decode("utf-8", "replace")


def _build_failed(folder: Path, log: str, command: str) -> str:
    lines = [visible(line) for line in log.splitlines() if line.strip()]
    if any("not found" in line or "No such file" in line for line in lines if "arm-none-eabi" in line):
        return f"{folder}: the chip's compiler is missing; to install it, see: fcu doctor"
    here = f"{folder.resolve()}/"  # prefix of source files in the linker's messages
    found = ([line.removeprefix(here) for line in lines if mark.search(line)] for mark in _MARKS)
    errors = next(filter(None, found), lines[-_ERRORS_SHOWN:])
    shown = [f"  {line[:WIDTH]}" for line in dict.fromkeys(errors)][:_ERRORS_SHOWN]
    again = command_line(["fcu", command, *([] if folder == Path() else [str(folder)])])
    title = f"{visible(str(folder))} does not build:"
    return "\n".join([title, *shown, f"Fix the first error, then run: {visible(again)}"])


@dataclass(frozen=True)
class _Unit:
    source: str
    object: str


class _Build:
    """One build of a project. Raises InputError for missing files."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._makefile = folder / "Makefile"
        self._support = folder / "support"
        missing = [name for name in _OPTIONS if not (self._support / name).is_file()]
        if missing:
            raise InputError(
                f"{self._support} must have {missing[0]}, as written by `fcu new`; build with make, "
                "or copy support/ from a new project"
            )
        try:
            text = self._makefile.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            raise InputError(f"cannot read {self._makefile}: {error.strerror or error}") from error
        given = {name: value.partition("#")[0].strip() for name, value in _ASSIGNMENT.findall(text)}
        self._bus = given.get("BUS") or FCU001V1.wiring().bus
        if self._bus not in _BUSES:
            raise InputError(f"{self._makefile}: BUS must be {' or '.join(_BUSES)}, not {self._bus}")
        self._flags = [*shlex.split(given.get("OPT", "-Og")), "@support/compile.options", "-Isupport"]
        self._flags += [f"-DSENSORS_ON_{self._bus}"] if self._bus != _BUSES[0] else []
        self._flags += shlex.split(given.get("EXTRA_CFLAGS", ""))
        self._gcc = _chosen(given.get("PREFIX", ""))

    def run(self) -> str:
        """Compile and link, and return the output. Raises BuildError, InputError."""
        self._forget_the_old_file()
        units = list(self._units())
        inputs, stamp = self._inputs(), self._folder / "build" / self._bus / "inputs.sha256"
        changed = not stamp.is_file() or stamp.read_text(encoding="ascii", errors="replace") != inputs
        stale = [unit for unit in units if changed or self._is_stale(unit)]
        stamp.unlink(missing_ok=True)  # objects of a failed build may be outdated
        for unit in stale:
            (self._folder / unit.object).parent.mkdir(parents=True, exist_ok=True)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            done = list(pool.map(self._compile, stale))
        log = "".join(text for _, text in done)
        if any(code for code, _ in done):
            raise BuildError(log)
        _write_text(stamp, inputs)
        linked = f"build/{self._bus}/{ELF}"
        script = ["@support/link.options", "-T", "support/STM32F401CC.ld"]
        objects = [unit.object for unit in units]
        code, text = self._call(["@support/cpu.options", *script, *objects, "-lm", "-o", linked])
        if code:
            raise BuildError(log + text)
        try:
            shutil.copyfile(self._folder / linked, self._folder / ELF)
        except OSError as error:
            raise InputError(f"cannot write {self._folder / ELF}: {error.strerror or error}") from error
        return log + text

    def _forget_the_old_file(self) -> None:
        """Delete the old ELF file, because the user must not run it after a failed build."""
        try:
            (self._folder / ELF).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"cannot replace {self._folder / ELF}: {error.strerror or error}") from error

    def _units(self) -> Iterator[_Unit]:
        """Yield units in the Makefile's link order."""
        for path in sorted(self._folder.glob("*.c")):
            yield _Unit(path.name, f"build/{self._bus}/{path.stem}.o")
        buses = [f"sensor_bus_{bus.lower()}" for bus in _BUSES]
        others = [path.stem for path in sorted(self._support.glob("*.c"))]
        others = [name for name in others if name not in buses]
        for name in (*others, buses[_BUSES.index(self._bus)]):
            yield _Unit(f"support/{name}.c", f"build/{self._bus}/support/{name}.o")

    def _is_stale(self, unit: _Unit) -> bool:
        made = self._folder / unit.object
        if not unit.source.startswith("support/") or not made.exists():
            return True
        inputs = [self._makefile, *self._support.iterdir()]
        return max(path.stat().st_mtime for path in inputs) > made.stat().st_mtime

    def _inputs(self) -> str:
        """Return a digest of the files on which support/ depends."""
        digest = sha256(str(self._gcc).encode())
        for path in [self._makefile, *sorted(self._support.iterdir())]:
            if path.is_file():
                digest.update(f"{path.name}\0".encode() + path.read_bytes() + b"\0")
        return digest.hexdigest()

    def _compile(self, unit: _Unit) -> tuple[int, str]:
        return self._call(
            ["@support/cpu.options", *self._flags, "-MMD", "-c", unit.source, "-o", unit.object]
        )

    def _call(self, arguments: Sequence[str]) -> tuple[int, str]:
        return _run([str(self._gcc), *arguments], self._folder)


def _write_text(file: Path, text: str) -> None:
    try:
        file.write_text(text, encoding="ascii")
    except OSError as error:
        raise InputError(f"cannot write {file}: {error.strerror or error}") from error


def _chosen(prefix: str) -> Path:
    """Return the compiler that PREFIX names (environment, then Makefile), or the first compiler found."""
    prefix = os.environ.get("PREFIX", "") or prefix
    if prefix and prefix != "arm-none-eabi-":
        return Path(f"{prefix}gcc")
    compiler = find_compiler()
    if compiler is None:
        raise InputError(f"{COMPILER} is not installed: {how_to_install(COMPILER)}")
    return compiler


def _prefix(compiler: Path) -> str:
    return (compiler.parent / "arm-none-eabi-").as_posix()
