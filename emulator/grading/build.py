"""Building what was handed in as source: the student's C files with our Makefile, in a sandbox.

The compiler reads what strangers wrote, and ``#include`` and ``.incbin`` name any file. So it runs under
bubblewrap: no network, nothing of the file system but the tools, read-only, and a folder of its own; with
limits on time, memory and size of files. A student's Makefile is never run. Where there is no bubblewrap,
only who asks for it (``sandbox=False``) gets a compiler without these walls; the limits hold all the same,
and root compiles as nobody, who reads only what everybody may.

Decision: the support layer is compiled once and its objects are copied into each build, which takes a tenth
of the time; the paths in the debug information are always the same, so the same source gives the same bytes,
and what has been built is found again by content. The road not taken, a container for each build, needs a
service with rights of its own.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from emulator.boards.fcu001v1 import FCU001V1
from emulator.errors import InputError, NotJudgedError
from emulator.files import write_atomically
from emulator.grading.submissions import Firmware, RejectedError, Source
from emulator.system_words import how_to_install_all
from emulator.text import one_line, visible
from firmware_model import arm

COMPILER: Final = "arm-none-eabi-gcc"
SANDBOX: Final = "bwrap"
_LONGEST_S = 60  # of wall time; the lab takes one
_CPU_S = 30
_MEMORY_KIB = 1 << 20  # of address space, for each process of the build
_FILE_BLOCKS = 65_536  # of 512 bytes: 32 MiB for a file
_LONGEST_LOG = 16_000  # characters that are kept of what the compiler says
_NOBODY = 65534
_HERE = "/build"  # where the compiler thinks it is
_TEMPLATE = "/template"
_FAILURE = re.compile(
    r"(?i)error:|undefined reference|multiple definition|out of memory|memory exhausted|overflowed by|stopped"
)
_LIMITED = (
    f"ulimit -t {_CPU_S}; ulimit -v {_MEMORY_KIB} 2>/dev/null; ulimit -f {_FILE_BLOCKS}; ulimit -c 0; "
    'exec "$@"'
)
_SYSTEM = ("/usr", "/bin", "/lib", "/lib32", "/lib64", "/etc/alternatives")
"""What compilers of a distribution need; without /etc/alternatives there is no math.h on Debian."""


class CompileError(RejectedError):
    """The program does not compile; ``log`` is what the compiler said."""

    def __init__(self, log: str) -> None:
        first = next(filter(_FAILURE.search, log.splitlines()), "")
        super().__init__("does not compile" + (f": {one_line(first)}" if first else ""))
        self.log = log


@dataclass(frozen=True)
class Built:
    """A program from source. ``log``: warnings; empty for none."""

    firmware: Firmware
    log: str


class Builder:
    """Builds for one wiring. ``kept``: a folder in which what was built is kept by content; None: nowhere.

    Raises InputError, saying what to install, when this machine cannot build; so does the first build.
    """

    def __init__(
        self, bus: str = FCU001V1.profile().bus, *, sandbox: bool = True, kept: Path | None = None
    ) -> None:
        if os.name != "posix":
            raise InputError("source is built on Linux and macOS; hand in ELF files, or grade there")
        missing = [
            name for name in (COMPILER, "make", *([SANDBOX] if sandbox else [])) if not shutil.which(name)
        ]
        if missing:
            raise InputError(_to_install(missing))
        self._bus = bus
        self.sandbox = sandbox
        self._kept = kept
        self._folder = TemporaryDirectory(prefix="fcu-build-")
        Path(self._folder.name).chmod(0o755)  # for nobody
        self._template = Path(self._folder.name) / "template"
        sources = arm.sources()
        shutil.copytree(sources / "support", self._template / "support")
        shutil.copyfile(sources / "scaffold" / "Makefile", self._template / "Makefile")
        self._toolchain = _toolchain(self._template, bus)
        self._support = threading.Lock()
        self._objects = Path(self._folder.name) / "objects"

    def close(self) -> None:
        """Remove what was only needed for building."""
        self._folder.cleanup()

    def build(self, source: Source) -> Built:
        """The program; what was built before is not built again. Safe to call in several threads.

        Raises CompileError, and NotJudgedError if the tools themselves failed.
        """
        key = hashlib.sha256(f"{self._toolchain} {source.digest}".encode()).hexdigest()
        built = self._known(key)
        if built is None:
            self._compile_support()
            built = self._build(source.files)
            self._keep(key, built)
        if built.firmware.data:
            return built
        raise CompileError(built.log)

    # -- what is known already

    def _known(self, key: str) -> Built | None:
        if self._kept is None:
            return None
        try:
            log = json.loads((self._kept / f"{key}.json").read_bytes())["log"]
            data = (self._kept / f"{key}.elf").read_bytes()
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return Built(Firmware("lab3.elf", data), str(log))

    def _keep(self, key: str, built: Built) -> None:
        if self._kept is not None:
            write_atomically(self._kept / f"{key}.elf", built.firmware.data)
            write_atomically(self._kept / f"{key}.json", json.dumps({"log": built.log}).encode())

    # -- the compiler

    def _compile_support(self) -> None:
        """Compile the support layer, which every program is linked with; once. Raises InputError."""
        with self._support, TemporaryDirectory(dir=self._folder.name) as folder:
            if self._objects.exists():
                return
            work = Path(folder)
            (work / "main.c").write_text("int main(void) { return 0; }\n")
            code, log = self._make(work)
            if code and "bwrap:" in log:
                how = "in a container that is thrown away, give --build-without-sandbox"
                raise InputError(f"bubblewrap cannot make its walls here ({_last_line(log)}); {how}")
            if code:
                raise InputError(f"this machine cannot build LAB3's template: {_last_line(log)}")
            shutil.copytree(work / "build" / self._bus / "support", self._objects)

    def _build(self, files: Mapping[str, bytes]) -> Built:
        with TemporaryDirectory(dir=self._folder.name) as folder:
            work = Path(folder)
            shutil.copytree(self._objects, work / "build" / self._bus / "support")
            for name, data in files.items():
                (work / name).write_bytes(data)
            code, log = self._make(work)
            made = work / "lab3.elf"
            if code == 0 and made.is_file():
                return Built(Firmware("lab3.elf", made.read_bytes()), log)
            return Built(Firmware("lab3.elf", b""), log or "the compiler ended without a word")

    def _make(self, work: Path) -> tuple[int, str]:
        """Run make in ``work``: its exit code, and what was said, fit to be shown."""
        here, template = (_HERE, _TEMPLATE) if self.sandbox else (str(work), str(self._template))
        command = [
            "make",
            "-s",
            "-f",
            f"{template}/Makefile",
            f"SUPPORT={template}/support",
            f"BUS={self._bus}",
        ]
        same_paths = f"-fdebug-prefix-map={work}={_HERE} -fdebug-prefix-map={self._template}={_TEMPLATE}"
        flags = "-fmax-errors=20 -fno-diagnostics-show-caret" + ("" if self.sandbox else f" {same_paths}")
        command.append(f"EXTRA_CFLAGS={flags}")
        if self.sandbox:
            command = [*_walls(work, self._template), *command]
        as_nobody = {} if self.sandbox else _as_nobody(work)
        environment = {"PATH": os.environ.get("PATH", os.defpath), "LC_ALL": "C"}
        output = work / "build.log"
        with output.open("wb") as sink:
            try:
                done = subprocess.run(
                    ["sh", "-c", _LIMITED, "sh", *command],
                    cwd=work,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=sink,
                    stderr=subprocess.STDOUT,
                    timeout=_LONGEST_S,
                    check=False,
                    **as_nobody,
                )
            except subprocess.TimeoutExpired:
                return 1, f"the compiler was stopped after {_LONGEST_S} s"
            except OSError as error:
                raise NotJudgedError(f"the compiler cannot be started: {error.strerror or error}") from error
        with output.open("rb") as source:
            said = source.read(4 * _LONGEST_LOG).decode("utf-8", errors="replace")
        return done.returncode, _readable(said, here, template)


def _as_nobody(work: Path) -> dict[str, Any]:
    """What lets root run a command in ``work`` as nobody; nothing for others."""
    if sys.platform != "win32" and os.geteuid() == 0:
        for path in (work, *work.rglob("*")):
            os.chown(path, _NOBODY, _NOBODY)
        return {"user": _NOBODY, "group": _NOBODY, "extra_groups": []}
    return {}


def _walls(work: Path, template: Path) -> list[str]:
    """bubblewrap's command line before the command."""
    compiler = Path(shutil.which(COMPILER) or COMPILER).resolve()
    tools = [*_SYSTEM, str(compiler.parent.parent)]
    return [
        SANDBOX,
        "--unshare-all",
        "--die-with-parent",
        "--new-session",
        *(part for path in tools for part in ("--ro-bind-try", path, path)),
        *("--ro-bind", str(template), _TEMPLATE),
        *("--dev", "/dev", "--tmpfs", "/tmp", "--bind", str(work), _HERE, "--chdir", _HERE),
    ]


def _toolchain(template: Path, bus: str) -> str:
    """A digest of all that makes the same source another program."""
    digest = hashlib.sha256(bus.encode())
    digest.update(_compiler_version().encode())
    for path in sorted(template.rglob("*")):
        if path.is_file():
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@functools.cache
def _compiler_version() -> str:
    done = subprocess.run([COMPILER, "--version"], capture_output=True, text=True, check=False)
    return done.stdout


def _readable(said: str, here: str, template: str) -> str:
    """The compiler's words without our paths and make's own lines."""
    text = visible(said, lines=True).replace(f"{here}/", "").replace(f"{template}/", "")
    lines = [line for line in text.splitlines() if not line.startswith(("make:", "make[", "  CC", "  LINK"))]
    text = "\n".join(lines)
    if len(text) > _LONGEST_LOG:
        text = text[:_LONGEST_LOG].rpartition("\n")[0] + "\n[... and more]"
    return text


def _last_line(log: str) -> str:
    return next(reversed([line for line in log.splitlines() if line.strip()]), "no reason given")


def _to_install(missing: Sequence[str]) -> str:
    """What to install, and what else there is to do; the sandbox is a thing of Linux."""
    to_be_had = [name for name in missing if name != SANDBOX or sys.platform.startswith("linux")]
    what = f"building source needs {' and '.join(missing)}"
    ways = [f"{what}: {how_to_install_all(to_be_had)}" if to_be_had else what]
    if SANDBOX not in to_be_had and SANDBOX in missing:
        ways.append(f"{SANDBOX} is there on Linux alone, in a container, too")
    ways.append("or grade ELF files only: --take firmware")
    if SANDBOX in missing:
        ways.append("or, if you trust every submission, --build-without-sandbox")
    return "; ".join(ways)
