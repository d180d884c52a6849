"""``fcu doctor``: check this machine, and list missing software."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import platform
import shutil
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import click

from fcu_emulator.emulator.cli.screen import ProgressLine, paint, wrapped
from fcu_emulator.emulator.cli.toolchain import COMPILER, find_compiler
from fcu_emulator.emulator.errors import FcuError
from fcu_emulator.emulator.host.install_hints import how_to_install

_PACKAGES = (
    *("numpy", "greenlet", "click", "pydantic", "pygeomag", "pyserial", "regex"),
    *("websockets", "hypothesis"),
)
_OPTIONAL_PACKAGES = {
    "PyYAML": ("yaml", "for fcu grade with downloads from Gradescope"),
    "distributed": ("distributed", "for fcu grade --dask on a cluster"),
}
"""Optional packages: name of the module, and purpose."""
_TERMINALS = {
    **({"screen": "screen", "minicom": "minicom"} if sys.platform != "win32" else {"ttermpro": "Tera Term"}),
    "putty": "PuTTY",
    "pyserial-miniterm": "pyserial-miniterm",
}
_BUILD_TOOLS = {
    "make": "not needed for fcu build",
    "gdb-multiarch": "the debugger for fcu run --gdb",
    "bwrap": "the sandbox in which fcu grade builds source",
}
_SPEED_TEST_S = 2.0
_MARK = 11  # width of the column of marks


@dataclass(frozen=True)
class MachineCheck:
    """One line of the report. ``needed``: the board cannot run without this item."""

    ok: bool
    text: str
    needed: bool = False


def examine() -> bool:
    """Print the report, and return whether everything that is needed is installed."""
    with ProgressLine("checking this machine"):
        findings = [_python(), *(_package(name) for name in _PACKAGES)]
        findings += [
            _library(),
            *map(_boots, ("lab3", "solution")),
            _port(),
            *_terminals(),
            *_build_tools(),
            *(_optional_package(*one) for one in _OPTIONAL_PACKAGES.items()),
        ]
    for title, needed in (("Required", True), ("Optional", False)):
        click.echo(paint(title, "heading"))
        for finding in findings:
            if finding.needed == needed:
                first, *rest = wrapped(f"{' ' * _MARK}{finding.text}", hang=0)
                click.echo("\n".join([f"  {_mark(finding)}  {first[_MARK:]}", *rest]))
        click.echo()
    healthy = all(finding.ok for finding in findings if finding.needed)
    click.echo(paint("Next", "heading"))
    click.echo("    fcu run" if healthy else "  Install the missing parts, then run fcu doctor again.")
    return healthy


def _mark(finding: MachineCheck) -> str:
    if finding.ok:
        return paint("ok     ", "pass")
    return paint("MISSING", "fail") if finding.needed else paint("absent ", "warning")


def _python() -> MachineCheck:
    where = f"Python {platform.python_version()} on {platform.system()} {platform.machine()}"
    return MachineCheck(True, where, needed=True)


def _package(name: str) -> MachineCheck:
    try:
        version = importlib.metadata.version(name)
        importlib.import_module("serial" if name == "pyserial" else name)
    except ImportError as error:
        return MachineCheck(False, f"{name}: {error}; pip install {name}", needed=True)
    return MachineCheck(True, f"{name} {version}", needed=True)


def _optional_package(name: str, of: tuple[str, str]) -> MachineCheck:
    module, purpose = of
    try:
        importlib.import_module(module)
    except ImportError:
        return MachineCheck(False, f"{name}: {purpose}; pip install {name}")
    return MachineCheck(True, f"{name} {importlib.metadata.version(name)}: {purpose}")


def _library() -> MachineCheck:
    from fcu_emulator.emulator.chip.native import FOLDER, built_from, library_name, loader

    if wrong := loader.problem():
        return MachineCheck(False, wrong, needed=True)
    _, compiler, version = built_from(FOLDER / library_name())
    return MachineCheck(True, f"the chip's C library, built with {compiler} ({version})", needed=True)


def _boots(firmware: str) -> MachineCheck:
    from fcu_emulator.emulator.assembly.board import Board

    started = time.perf_counter()
    try:
        board = Board(firmware=firmware)
        board.terminal.expect(r"LAB3 Init\.\.\.\n", timeout_s=_SPEED_TEST_S)
        board.run_for(_SPEED_TEST_S)
    except (FcuError, ImportError) as error:
        return MachineCheck(False, f"the firmware {firmware} does not boot: {error}", needed=True)
    factor = board.now_s / (time.perf_counter() - started)
    return MachineCheck(
        True, f"the firmware {firmware} boots and runs at {factor:.1f} x real time", needed=True
    )


def _port() -> MachineCheck:
    from fcu_emulator.emulator.links import open_link

    try:
        link = open_link("port")
    except FcuError as error:
        return MachineCheck(False, f"serial port for terminal programs: {error}")
    where = link.announce()[0].removeprefix("serial: ").partition(";")[0]
    link.close()
    return MachineCheck(True, f"serial port for terminal programs, fcu run --serial port: {where}")


def _terminals() -> list[MachineCheck]:
    here = str(Path(sys.executable).parent)
    path = os.pathsep.join((here, os.environ.get("PATH", "")))
    findings = []
    for command, name in _TERMINALS.items():
        if shutil.which(command, path=path):
            findings.append(MachineCheck(True, f"terminal program {name}"))
        else:
            findings.append(MachineCheck(False, f"terminal program {name}; fcu terminal replaces it"))
    return findings


def _build_tools() -> list[MachineCheck]:
    compiler = find_compiler()
    return [
        MachineCheck(True, f"the chip's compiler: {compiler}")
        if compiler
        else MachineCheck(
            False, f"{COMPILER}: the chip's compiler, for fcu build; {how_to_install(COMPILER)}"
        )
    ] + [
        MachineCheck(True, tool)
        if shutil.which(tool)
        else MachineCheck(False, f"{tool}: {purpose}; {how_to_install(tool)}")
        for tool, purpose in _BUILD_TOOLS.items()
    ]
