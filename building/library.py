"""Build the C library beside its sources, emulator/chip/native, if outdated: python building/library.py [--force]

``CC`` is the compiler's command, with arguments if needed (``CC="gcc -m64"``). By default the compiler is ``cc`` if
it works, else zig from ziglang.
``CFLAGS`` and ``LDFLAGS`` are added, as packagers expect.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import runpy
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
FOLDER: Final = ROOT / "emulator" / "chip" / "native"
NATIVE: Final = runpy.run_path(str(FOLDER / "__init__.py"))

FLAGS: Final = (
    "-std=gnu11",
    "-O2",
    # Code that writes the CPU's flags together and then reads them one by one
    # is a fifth faster without vectorisation.
    "-fno-tree-slp-vectorize",
    "-fwrapv",  # signed sums wrap with every compiler, as on the chip
    # Export only the functions of fcu.h. Then calls of other functions are direct; polling loops run a sixth faster.
    "-fvisibility=hidden",
    "-ffp-contract=off",  # products and sums are rounded separately, as on the chip
)
ZIG: Final = "ziglang~=0.17.0"
"""Tested versions of ziglang, in the form of a pip requirement."""
_ZIG_FLAGS: Final = (
    "-mcpu=baseline",  # otherwise the library would need a CPU with this machine's instructions
    "-g0",
    "-s",
)
_TRIAL: Final = "long long trial(long long a, long long b) { return (long long)((__int128)a * b >> 64); }\n"


class BuildError(Exception):
    """The library cannot be built; the message has the reason and a fix."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: command, name, flags, and ``sys.platform`` of its output."""

    command: tuple[str, ...]
    name: str
    flags: tuple[str, ...] = ()
    system: str = sys.platform

    @property
    def description(self) -> str:
        """Compiler name, and the flags in CFLAGS."""
        text = f"{self.name} {os.environ.get('CFLAGS', '')}".strip()
        return text.replace("\\", "/").replace('"', "'")

    @property
    def position_independent(self) -> tuple[str, ...]:
        """Flag for position-independent code; empty on Windows, where clang refuses it."""
        return () if self.system == "win32" else ("-fPIC",)

    def run(self, *arguments: str | Path) -> None:
        """Run the compiler. Raises BuildError if it fails."""
        line = [*self.command, *self.flags, *map(str, arguments)]
        try:
            done = subprocess.run(line, capture_output=True, text=True, check=False)
        except OSError as error:
            raise BuildError(f"{self.name}: {error}") from error
        if done.returncode:
            raise BuildError(f"{shlex.join(line)}\n{done.stdout}{done.stderr}")


def compiler() -> Compiler:
    """Return this machine's compiler or zig. Raises BuildError."""
    return own_compiler() or zig()


def own_compiler() -> Compiler | None:
    """Return ``CC`` or ``cc``; None if zig is needed. Raises BuildError for an unsupported system."""
    if sys.maxsize < 2**32:
        raise BuildError("32-bit systems are not supported: the library needs 128-bit integers (__int128)")
    words = shlex.split(os.environ.get("CC", ""), posix=os.name == "posix")
    if not words:
        cc = Compiler(("cc",), "cc")
        return cc if _works(cc) else None
    if Path(words[0]).stem.lower() in ("cl", "clang-cl"):
        raise BuildError(f"CC={words[0]}: Microsoft's compiler is not supported; unset CC, and zig is used")
    return Compiler(tuple(words), " ".join(words))


def zig(system: str = sys.platform, *flags: str) -> Compiler:
    """Return zig. Raises BuildError if ziglang is missing."""
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError(
            "no C compiler here makes a library that this Python can load (cc; CC names another one): "
            f"install gcc or clang, or {sys.executable} -m pip install {ZIG}"
        )
    return Compiler((sys.executable, "-m", "ziglang", "cc"), "zig cc", (*_ZIG_FLAGS, *flags), system)


@cache
def _works(compiler: Compiler) -> bool:
    if shutil.which(compiler.command[0]) is None:
        return False
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        source, library = Path(folder, "trial.c"), Path(folder, "trial.lib")
        source.write_text(_TRIAL, encoding="utf-8")
        try:
            compiler.run("-shared", *compiler.position_independent, source, "-o", library)
            ctypes.CDLL(str(library))
        except (BuildError, OSError):
            return False
    return True


def write_headers(folder: Path) -> None:
    """Generate the headers from the declarations in Python."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "fcu_emulator.emulator.chip.registers", str(folder)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"the C headers cannot be generated:\n{done.stderr}")


def build(library: Path, compiler: Compiler) -> None:
    """Compile the sources in parallel, then install the library in one step."""
    flags = *FLAGS, *compiler.position_independent, *shlex.split(os.environ.get("CFLAGS", ""))
    libraries = "-lm", *shlex.split(os.environ.get("LDFLAGS", ""))
    macros = f'-DSOURCES="{NATIVE["digest"](FOLDER)}"', f'-DCOMPILER="{compiler.description}"'
    files = [path for path in NATIVE["sources"](FOLDER) if path.suffix == ".c"]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        write_headers(Path(folder, "generated"))
        objects = [Path(folder, f"{number}.o") for number in range(len(files))]

        def compile_one(source: Path, result: Path) -> None:
            compiler.run(*flags, *macros, f"-I{folder}", f"-I{FOLDER}", "-c", source, "-o", result)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(compile_one, files, objects))
        made = library.with_name(f"{library.name}.{os.getpid()}")
        try:
            compiler.run("-shared", *flags, *objects, *libraries, "-o", made)
            made.replace(library)  # running processes keep the library that they have loaded
        finally:
            made.unlink(missing_ok=True)


def build_in_place(force: bool = False) -> str:
    """Build the library if it is outdated; return a message."""
    library = FOLDER / NATIVE["library_name"]()
    chosen = compiler()
    write_headers(FOLDER / "generated")  # for editors and tests; the library is compiled with a separate copy
    digest, description, _ = NATIVE["built_from"](library)
    if not force and (digest, description) == (NATIVE["digest"](FOLDER), chosen.description):
        return f"{library} fits its sources"
    build(library, chosen)
    return f"{library} was built with {chosen.description}"


if __name__ == "__main__":
    if set(sys.argv[1:]) - {"--force"}:
        sys.exit(__doc__)
    try:
        sys.stdout.write(build_in_place("--force" in sys.argv) + "\n")
    except BuildError as problem:
        sys.exit(f"building/library.py: {problem}")
