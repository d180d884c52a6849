"""Build submitted source: compile the student's C files with this project's Makefile, in a sandbox.

Source code can include any file, so the compiler runs under bubblewrap with limits and without network.
With ``sandbox=False`` only the limits apply; if fcu runs as root, the compiler runs as the user ``nobody``.

Decision: the support layer is compiled only one time and copied into each build, so that a build
takes a tenth of the time. A container for each build was rejected: it needs a privileged service.

Decision: after a failed build, a control program is compiled, and then the submission again,
because the machine must never cause the result "does not compile". Searching the messages for the
cause was rejected, because source code can produce the same messages.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.grading.submissions import RejectedError, SubmittedFirmware, SubmittedSource
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.host.install_hints import how_to_install_all
from fcu_emulator.emulator.host.process_group import kill_group
from fcu_emulator.emulator.text import one_line, visible
from fcu_emulator.firmware_model import arm

COMPILER: Final = "arm-none-eabi-gcc"
SANDBOX: Final = "bwrap"
_LONGEST_S = 60  # wall time; the lab takes one second
_CPU_S = 30  # processor time of each process
_MEMORY_KIB = 1 << 20  # address space of each process
_FILE_BLOCKS = 65_536  # maximum blocks of 512 bytes in a file: 32 MiB
_LONGEST_LOG = 16_000  # characters kept
_NOBODY = 65534
_OF_MAKE = ("make:", "make[", "  CC", "  LINK", "collect2: ")
_FORMAT = 3  # version of the format of kept builds
_HERE = "/build"  # paths that the compiler sees
_TEMPLATE = "/template"
_FAILURE = re.compile(
    r"(?i)error:|undefined reference|multiple definition|out of memory|memory exhausted|overflowed by|stopped"
)
_TWICE = re.compile(
    r"(?m)^(\S+\.o:)?(?P<here>[\w+.-]+\.c)?[^\s]* multiple definition of [`'](?P<name>[^']+)';"
    r" (\S+\.o:)?(?P<there>[\w+.-]+\.c)?"
)
_UNDEFINED = re.compile(r"(?m)^(?P<where>[\w+.-]+\.c(:\d+)?)?\S* undefined reference to [`'](?P<name>[^']+)'")
_A_FILE = "another file"  # shown if the linker does not name the file
_LINKER = re.compile(r"(?m)^(?:/\S*/)?(?:arm-none-eabi-)?ld: (?:in function [`'].*:$\n?)?")
_OBJECT = re.compile(r"\bbuild/\w+/(\w[\w+.-]*)\.o\b")
_LIMITED = (
    f"ulimit -S -t {_CPU_S}; ulimit -H -t {_CPU_S + 3}; ulimit -v {_MEMORY_KIB} 2>/dev/null; "
    f'ulimit -f {_FILE_BLOCKS}; ulimit -c 0; exec "$@"'
)
"""The soft limit of processor time is lower than the hard limit, so SIGXCPU ends a process, not SIGKILL."""
_SYSTEM = ("/usr", "/bin", "/lib", "/lib32", "/lib64", "/etc/alternatives")
"""Folders that a compiler needs. On Debian, math.h is found only with /etc/alternatives."""
_OF_A_TOOLCHAIN = (
    *(f"bin/{COMPILER.removesuffix('gcc')}*", "arm-none-eabi", "lib/arm-none-eabi"),
    *("lib/gcc/arm-none-eabi", "libexec/gcc/arm-none-eabi", "lib/*.so*", "libexec/*.so*"),
)
"""Files of a toolchain outside of system folders. The whole prefix is not used, because it may be a home folder."""
_WATCH = """\
"$@"
code=$?
[ $code -le 128 ] || echo $((code - 128)) >>signals
exit $code
"""
"""Script that runs each compiler program and records the signal that ended it. Source code can forge messages, but
not this record.
"""
_MADE_ERRORS = 2  # exit code of make if a command failed
_CONTROL = {"main.c": b"int main(void) { return 0; }\n"}
_STOPS = {
    "SIGXCPU": f"error: the compiler was stopped after {_CPU_S} s of processor time",
    "SIGXFSZ": f"error: the compiler was stopped: a file became larger than {_FILE_BLOCKS // 2048} MiB",
    **dict.fromkeys(
        ("SIGSEGV", "SIGABRT", "SIGILL", "SIGFPE"), "error: the compiler crashed on this program"
    ),
}
"""Signals that the source code can cause. Other signals come from outside."""


class CompileError(RejectedError):
    """The program does not compile. ``log`` has the compiler's messages."""

    def __init__(self, log: str) -> None:
        # lines with a leading space quote the student's source
        first = next((line for line in log.splitlines() if line[:1] != " " and _FAILURE.search(line)), "")
        super().__init__(_link_error(log) or "does not compile" + (f": {one_line(first)}" if first else ""))
        self.log = log


def _link_error(log: str) -> str:
    twice = list(_TWICE.finditer(log))
    if twice:
        match = next((one for one in twice if one["name"] == "main"), twice[0])
        first, second = sorted(
            (match["here"] or _A_FILE, match["there"] or _A_FILE), key=lambda name: (name != "main.c", name)
        )
        name = one_line(match["name"], 60)
        if first == second:
            return f"does not link: {name} is defined twice in {first}; leave one definition"
        if name == "main":
            return f"must have one main(), but {first} and {second} both define it; hand in one of them"
        return f"does not link: {name} is defined in {first} and in {second}; leave one definition"
    if undefined := _UNDEFINED.search(log):
        name = one_line(undefined["name"], 60)
        if name == "main":
            return "must have a main(), but no submitted file defines it; hand in the whole program"
        where = f"{undefined['where']} uses" if undefined["where"] else "the program uses"
        return f"does not link: {where} {name}, which no submitted file defines"
    return ""


@dataclass(frozen=True)
class Built:
    """A program built from source, and the compiler's warnings."""

    firmware: SubmittedFirmware
    log: str


class _Made(NamedTuple):
    folder: Path
    code: int
    log: str
    stop: str = ""


class Builder:
    """Builder for one wiring. ``kept``: folder of earlier builds, or None.

    The constructor or the first build raises InputError if this machine cannot build.
    """

    def __init__(
        self, bus: str = FCU001V1.wiring().bus, *, sandbox: bool = True, kept: Path | None = None
    ) -> None:
        if os.name != "posix":
            raise InputError(
                "cannot build source on this system; hand in ELF files, or grade on Linux or macOS"
            )
        missing = [
            name for name in (COMPILER, "make", *([SANDBOX] if sandbox else [])) if not shutil.which(name)
        ]
        if missing:
            raise InputError(_to_install(missing))
        self._bus = bus
        self.sandbox = sandbox
        self._kept = kept
        self._folder = TemporaryDirectory(prefix="fcu-build-")
        Path(self._folder.name).chmod(0o755)  # for the user nobody
        self._template = Path(self._folder.name) / "template"
        try:
            self._lay_out_template()
        except OSError:
            self._folder.cleanup()
            raise
        self._toolchain = _toolchain(self._template, bus)
        self._support = threading.Lock()
        self._processes: set[subprocess.Popen[bytes]] = set()
        self._processes_lock = threading.Lock()
        self._stopped = False
        self._objects = Path(self._folder.name) / "objects"

    def _lay_out_template(self) -> None:
        sources = arm.sources()
        shutil.copytree(sources / "support", self._template / "support")
        shutil.copyfile(sources / "scaffold" / "Makefile", self._template / "Makefile")
        (self._template / "watch").write_text(_WATCH)

    def close(self) -> None:
        self._folder.cleanup()

    def build(self, source: SubmittedSource) -> Built:
        """Return the program, possibly from an earlier build. Thread-safe.

        Raises CompileError if the source is at fault, NotJudgedError or InputError if the machine is
        at fault.
        """
        key = hashlib.sha256(f"{_FORMAT} {self._toolchain} {source.digest}".encode()).hexdigest()
        built = self._known(key)
        if built is None:
            try:
                self._compile_support()
                built = self._build(source.files)
            except OSError as error:  # includes shutil.Error
                reason = one_line(error.strerror or str(error), 120)
                raise NotJudgedError(f"cannot build source on this machine: {reason}") from error
            self._keep(key, built)
        if built.firmware.data:
            return built
        raise CompileError(built.log)

    def stop(self) -> None:
        """Stop all compilers permanently."""
        self._stopped = True
        with self._processes_lock:
            for process in self._processes:
                kill_group(process)

    # -- earlier builds

    def _known(self, key: str) -> Built | None:
        if self._kept is None:
            return None
        try:
            log = json.loads((self._kept / f"{key}.json").read_bytes())["log"]
            data = (self._kept / f"{key}.elf").read_bytes()
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return Built(SubmittedFirmware("lab3.elf", data), str(log))

    def _keep(self, key: str, built: Built) -> None:
        if self._kept is not None:
            write_atomically(self._kept / f"{key}.elf", built.firmware.data)
            write_atomically(self._kept / f"{key}.json", json.dumps({"log": built.log}).encode())

    # -- the compiler

    def _compile_support(self) -> None:
        """Compile the support layer if it is not yet compiled. Raises InputError."""
        with self._support:
            if self._objects.exists():
                return
            with self._attempt(_CONTROL, with_support=False) as made:
                if made.code and "bwrap:" in made.log:
                    how = "in a disposable container: --build-without-sandbox"
                    reason = f"bubblewrap cannot create a sandbox on this machine ({_last_line(made.log)})"
                    raise InputError(f"{reason}; {how}")
                if made.code:
                    raise InputError(f"cannot build LAB3's template on this machine: {_last_line(made.log)}")
                objects = made.folder / "build" / self._bus / "support"
                half = self._objects.with_suffix(".half")
                shutil.rmtree(half, ignore_errors=True)
                shutil.copytree(objects, half)
                half.rename(self._objects)

    def _build(self, files: Mapping[str, bytes]) -> Built:
        built = self._build_once(files)
        if built is None:
            self._check_machine()
            built = self._build_once(files, final=True)
        assert built is not None
        return built

    def _build_once(self, files: Mapping[str, bytes], *, final: bool = False) -> Built | None:
        """Build one time. Return None if the build fails and the machine may be the cause."""
        with self._attempt(files) as made:
            elf = made.folder / "lab3.elf"
            if made.code == 0 and elf.is_file():
                return Built(SubmittedFirmware("lab3.elf", elf.read_bytes()), made.log)
            if not (final or made.stop):
                return None
            log = "\n".join(filter(None, (made.log, made.stop))) or "error: the compiler printed no reason"
            return Built(SubmittedFirmware("lab3.elf", b""), log)

    def _check_machine(self) -> None:
        """To test the machine, compile the control program in a folder that contains a large file. Raises
        NotJudgedError."""
        with self._attempt(_CONTROL, ballast=_FILE_BLOCKS * 512) as made:
            if made.code:
                reason = _last_line(made.log)
                raise NotJudgedError(f"cannot compile any program on this machine at present: {reason}")

    @contextmanager
    def _attempt(
        self, files: Mapping[str, bytes], *, with_support: bool = True, ballast: int = 0
    ) -> Iterator[_Made]:
        """Run make in a new folder, after writing ``ballast`` bytes."""
        with TemporaryDirectory(dir=self._folder.name, ignore_cleanup_errors=True) as folder:
            work = Path(folder)
            (work / "tmp").mkdir()
            if with_support:
                shutil.copytree(self._objects, work / "build" / self._bus / "support")
            for name, data in files.items():
                (work / name).write_bytes(data)
            if ballast:
                (work / "ballast").write_bytes(bytes(ballast))
            yield self._make(work)

    def _make(self, work: Path) -> _Made:
        """Run make. Raises NotJudgedError if make or the compiler was killed from outside."""
        here, template = (_HERE, _TEMPLATE) if self.sandbox else (str(work), str(self._template))
        compiler = _toolchain_of_path().compiler
        command = [
            "make",
            "-s",
            "-f",
            f"{template}/Makefile",
            f"CC=/bin/sh {template}/watch {_quoted(compiler)} -wrapper /bin/sh,{template}/watch",
            f"SUPPORT={template}/support",
            f"BUS={self._bus}",
        ]
        same_paths = f"-fdebug-prefix-map={work}={_HERE} -fdebug-prefix-map={self._template}={_TEMPLATE}"
        flags = "-fmax-errors=20" + ("" if self.sandbox else f" {same_paths}")
        command.append(f"EXTRA_CFLAGS={flags}")
        if self.sandbox:
            command = [*_sandbox(work, self._template), *command]
        output = work / "build.log"
        code = self._run(command, work, output)
        with output.open("rb") as source:
            said = source.read(4 * _LONGEST_LOG).decode("utf-8", errors="replace")
        log = _readable(said, here, template)
        if code is None:
            return _Made(work, _MADE_ERRORS, f"{log}\nerror: the compiler was stopped after {_LONGEST_S} s")
        signals = _signals(work / "signals")
        outside = [name for name in signals if name not in _STOPS]
        if outside or code not in (0, _MADE_ERRORS):
            cause = outside[0] if outside else f"exit code {code}, {_last_line(log)}"
            raise NotJudgedError(f"the compiler was killed ({cause})")
        return _Made(work, code, log, next((_STOPS[name] for name in signals), ""))

    def _run(self, command: Sequence[str], work: Path, output: Path) -> int | None:
        environment = {"PATH": os.environ.get("PATH", os.defpath), "LC_ALL": "C"}
        if not self.sandbox:
            environment["TMPDIR"] = str(work / "tmp")
        as_nobody = {} if self.sandbox else _as_nobody(work)
        with output.open("wb") as sink:
            process = subprocess.Popen(
                ["sh", "-c", _LIMITED, "sh", *command],
                cwd=work,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # a separate process group, so that all processes can be ended
                **as_nobody,
            )
        with self._processes_lock:
            self._processes.add(process)
        try:
            if self._stopped:
                kill_group(process)
            code: int | None = process.wait(_LONGEST_S)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            if process.poll() is None:
                kill_group(process)
                process.wait()
            with self._processes_lock:
                self._processes.discard(process)
        return code


def _quoted(path: str) -> str:
    return shlex.quote(path).replace("$", "$$")


def _signals(file: Path) -> list[str]:
    if not file.exists():
        return []
    known = {one.value: one.name for one in signal.Signals}
    return [known.get(int(line), f"signal {line}") for line in file.read_text().split()]


def _as_nobody(work: Path) -> dict[str, Any]:
    if sys.platform != "win32" and os.geteuid() == 0:
        for path in (work, *work.rglob("*")):
            os.chown(path, _NOBODY, _NOBODY)
        return {"user": _NOBODY, "group": _NOBODY, "extra_groups": []}
    return {}


def _sandbox(work: Path, template: Path) -> list[str]:
    tools = [*_SYSTEM, *_toolchain_of_path().files]
    return [
        SANDBOX,
        "--unshare-all",
        "--die-with-parent",
        "--new-session",
        *("--tmpfs", "/tmp"),
        *(part for path in tools for part in ("--ro-bind-try", path, path)),
        *("--ro-bind", str(template), _TEMPLATE),
        *("--dir", "/dev", "--dev-bind", "/dev/null", "/dev/null"),  # reading /dev/ptmx never ends
        *("--bind", str(work), _HERE, "--chdir", _HERE),
    ]


class _Toolchain(NamedTuple):
    compiler: str
    files: tuple[str, ...]


@functools.cache
def _toolchain_of_path() -> _Toolchain:
    """Return the toolchain of the compiler on the PATH. The compiler may be a link or a script."""
    found = Path(shutil.which(COMPILER) or COMPILER).resolve()
    said = subprocess.run([found, "-print-search-dirs"], capture_output=True, text=True, check=False).stdout
    install = Path(os.path.normpath(said.partition("\n")[0].removeprefix("install:").strip()))
    prefix = install.parents[3] if len(install.parents) > 3 else found.parent.parent
    compiler = prefix / "bin" / COMPILER
    if not compiler.exists():
        compiler = found
    if any(prefix.is_relative_to(folder) for folder in _SYSTEM):
        return _Toolchain(str(compiler), ())
    files = sorted(str(path) for pattern in _OF_A_TOOLCHAIN for path in prefix.glob(pattern))
    return _Toolchain(str(compiler), (*files, str(compiler)))


def _toolchain(template: Path, bus: str) -> str:
    """Return a digest of everything that affects the built program, except the source."""
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
    text = visible(said, lines=True)
    for folder in (here, template, _HERE, _TEMPLATE):
        text = text.replace(f"{folder}/", "")
    text = _OBJECT.sub(r"\1.o", _LINKER.sub("", text))
    lines = [line for line in text.splitlines() if not line.startswith(_OF_MAKE)]
    text = "\n".join(lines)
    if len(text) > _LONGEST_LOG:
        text = text[:_LONGEST_LOG].rpartition("\n")[0] + "\n[... and more]"
    return text


def _last_line(log: str) -> str:
    return next(reversed([line for line in log.splitlines() if line.strip()]), "no reason printed")


def _to_install(missing: Sequence[str]) -> str:
    to_be_had = [name for name in missing if name != SANDBOX or sys.platform.startswith("linux")]
    what = f"cannot build source without {' and '.join(missing)}"
    ways = [f"{what}: {how_to_install_all(to_be_had)}" if to_be_had else what]
    if SANDBOX not in to_be_had and SANDBOX in missing:
        ways.append(f"{SANDBOX} exists on Linux only, also in a container")
    ways.append("or grade ELF files only: --submission-type firmware")
    if SANDBOX in missing:
        ways.append("or, if you trust every submission, --build-without-sandbox")
    return "; ".join(ways)
