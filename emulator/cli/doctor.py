"""``fcu doctor``: check this machine, and say what to install."""

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

from fcu_emulator.emulator.cli.toolchain import COMPILER, find_compiler
from fcu_emulator.emulator.errors import FcuError
from fcu_emulator.emulator.host.install_hints import how_to_install
from fcu_emulator.emulator.text import visible

_PACKAGES = (
    *("numpy", "greenlet", "click", "pydantic", "pygeomag", "pyserial", "regex"),
    *("websockets", "hypothesis"),
)
_OPTIONAL_PACKAGES = {
    "PyYAML": ("yaml", "with it fcu grade reads downloads of Gradescope"),
    "distributed": ("distributed", "with it fcu grade --dask judges on a cluster"),
}
"""Optional packages: module and purpose."""
_TERMINALS = {
    **({"screen": "screen", "minicom": "minicom"} if sys.platform != "win32" else {"ttermpro": "Tera Term"}),
    "putty": "PuTTY",
    "pyserial-miniterm": "pyserial-miniterm",
}
_BUILD_TOOLS = {
    "make": "fcu build does without",
    "gdb-multiarch": "the debugger for fcu run --gdb",
    "bwrap": "the sandbox in which fcu grade builds source",
}
_SPEED_TEST_S = 2.0


@dataclass(frozen=True)
class MachineCheck:
    """One line of the report; ``needed`` to run the board."""

    ok: bool
    text: str
    needed: bool = False


def examine() -> bool:
    """Print the report; return whether all needed parts are installed."""
    findings = [_python(), *(_package(name) for name in _PACKAGES)]
    findings += [
        _library(),
        *map(_boots, ("lab3", "solution")),
        _port(),
        *_terminals(),
        *_build_tools(),
        *(_optional_package(*one) for one in _OPTIONAL_PACKAGES.items()),
    ]
    for finding in findings:
        mark = "ok     " if finding.ok else ("MISSING" if finding.needed else "absent ")
        click.echo(f"{mark}  {visible(finding.text)}")
    healthy = all(finding.ok for finding in findings if finding.needed)
    click.echo("\nThe board runs here: fcu run" if healthy else "\nInstall what is missing, then try again.")
    return healthy


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
        return MachineCheck(False, f"{name}: optional, {purpose}: pip install {name}")
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
    return MachineCheck(True, f"serial port for terminal programs: fcu run --serial port: {where}")


def _terminals() -> list[MachineCheck]:
    here = str(Path(sys.executable).parent)
    path = os.pathsep.join((here, os.environ.get("PATH", "")))
    findings = []
    for command, name in _TERMINALS.items():
        if shutil.which(command, path=path):
            findings.append(MachineCheck(True, f"terminal program {name}"))
        else:
            findings.append(
                MachineCheck(False, f"terminal program {name}: optional; fcu terminal does as well")
            )
    return findings


def _build_tools() -> list[MachineCheck]:
    compiler = find_compiler()
    return [
        MachineCheck(True, f"the chip's compiler: {compiler}")
        if compiler
        else MachineCheck(
            False, f"{COMPILER}: optional, the chip's compiler, for fcu build: {how_to_install(COMPILER)}"
        )
    ] + [
        MachineCheck(True, tool)
        if shutil.which(tool)
        else MachineCheck(False, f"{tool}: optional, {purpose}: {how_to_install(tool)}")
        for tool, purpose in _BUILD_TOOLS.items()
    ]
