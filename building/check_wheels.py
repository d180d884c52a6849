"""Check the wheels in a folder: python building/check_wheels.py [FOLDER]

Each wheel must have one current C library that needs only system libraries. The source archive must have the committed
files. The script needs lief and auditwheel; see docs/building.md.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from zipfile import ZipFile

import lief
from library import FOLDER, NATIVE
from targets import TARGETS, Target

_PLACE: Final = "fcu_emulator/emulator/chip/native/"
_GENERATED: Final = "emulator/chip/native/generated/"
_MACHINES: Final = {
    "x86_64": ("X86_64", "AMD64"),
    "amd64": ("X86_64", "AMD64"),
    "aarch64": ("AARCH64", "ARM64"),
    "arm64": ("AARCH64", "ARM64"),
}
_OLDEST_MACOS: Final = [11, 0, 0]
_WINDOWS_HAS: Final = re.compile(r"kernel32\.dll|api-ms-win-crt-\w+-l1-1-0\.dll")
"""Libraries of the system. api-ms-win-crt is the Universal C Runtime of Windows 10 and later."""


def check(wheel: Path, target: Target) -> Iterator[str]:
    """Yield descriptions of the wheel's properties. Raises AssertionError if a property is wrong."""
    with ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if name.startswith(_PLACE)]
        assert not [name for name in names if name.endswith((".c", ".h"))], "it has C sources"
        name = _PLACE + NATIVE["library_name"](target.system)
        assert [name for name in names if not name.endswith(".py")] == [name], names
        content = archive.read(name)
        info = next(name for name in archive.namelist() if name.endswith(".dist-info/WHEEL"))
        tags = re.findall(r"^Tag: (\S+)$", archive.read(info).decode(), flags=re.MULTILINE)
    assert sorted(tags) == sorted(f"py3-none-{tag}" for tag in target.tag.split(".")), tags
    yield f"{_carried(wheel)} files that are no program"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "library")
        file.write_bytes(content)
        digest, compiler, _ = NATIVE["built_from"](file)
    assert digest == NATIVE["digest"](FOLDER), "it was built from other sources"
    yield f"{wheel.stat().st_size / 1e6:.1f} MB, library {len(content) / 1e3:.0f} kB by {compiler}"

    library = lief.parse(content)
    machine = str(library.header.cpu_type if target.system == "darwin" else _machine(library)).split(".")[-1]
    assert machine in _MACHINES[re.split("_(?=x86|a)", target.tag)[-1]], machine
    looks = {"linux": _linux, "darwin": _macos, "win32": _windows}
    yield from looks[target.system](library, wheel, target)


def _carried(wheel: Path) -> int:
    root = Path(__file__).parents[1]
    folders = {
        "emulator/live/page": "*.*",
        "scenarios": "*.toml",
        "scenarios/rubrics": "*.toml",
        "firmware_model/arm": "**/*.elf",
        "docs": "*.md",
    }
    wanted = set()
    for folder, pattern in folders.items():
        found = {
            f"fcu_emulator/{path.relative_to(root).as_posix()}" for path in (root / folder).glob(pattern)
        }
        assert found, f"there is nothing in {folder}"
        wanted |= found
    with ZipFile(wheel) as archive:
        missing = wanted - set(archive.namelist())
    assert not missing, f"the wheel lacks {', '.join(sorted(missing))}"
    return len(wanted)


def _machine(library: Any) -> Any:
    header = library.header
    return header.machine_type if isinstance(library, lief.ELF.Binary) else header.machine


def _linux(library: Any, wheel: Path, target: Target) -> Iterator[str]:
    needs = set(library.libraries)
    if "musllinux" in target.tag:
        assert needs == {"libc.so"}, needs
        yield "needs libc.so, by which name musl's loader knows itself"
        return
    assert needs <= {"libc.so.6", "libm.so.6"}, needs
    command = [sys.executable, "-m", "auditwheel", "show", str(wheel)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = re.search(r'platform\s+tag:\s+"(manylinux_\w+)"', done.stdout)
    assert found, done.stdout + done.stderr
    assert _as_numbers(found[1]) <= _as_numbers(target.tag.split(".")[-1]), done.stdout
    yield f"needs {', '.join(sorted(needs))}; auditwheel: {found[1]}"


def _as_numbers(tag: str) -> tuple[str, int, int, str]:
    libc, major, minor, machine = tag.split("_", maxsplit=3)
    return libc, int(major), int(minor), machine


def _macos(library: Any, _wheel: Path, target: Target) -> Iterator[str]:
    oldest = list(library.build_version.minos)
    assert oldest == _OLDEST_MACOS, oldest
    assert library.build_version.platform == lief.MachO.BuildVersion.PLATFORMS.MACOS
    own, *others = (command.name for command in library.libraries)
    assert own == "@rpath/libfcu.dylib", own
    assert others == ["/usr/lib/libSystem.B.dylib"], others
    assert library.has_code_signature or "arm64" not in target.tag, "arm64 refuses code without a signature"
    signed = "signed ad hoc" if library.has_code_signature else "not signed"
    yield f"macOS {oldest[0]}.{oldest[1]} or later, {signed}, needs libSystem"


def _windows(library: Any, _wheel: Path, _target: Target) -> Iterator[str]:
    needs = sorted(imported.name for imported in library.imports)
    assert all(_WINDOWS_HAS.fullmatch(name.lower()) for name in needs), needs
    yield f"needs {', '.join(needs)}"


def check_archive(archive: Path) -> str:
    """Return the number of files. Raises AssertionError if the files differ from the committed files."""
    with tarfile.open(archive) as content:
        names = {member.name.partition("/")[2] for member in content if not member.isdir()}
    names = {name for name in names if not name.startswith(_GENERATED)}
    command = ["git", "-C", str(Path(__file__).parents[1]), "ls-files", "-z"]
    committed = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split("\0")
    differing = names ^ {*filter(None, committed), "PKG-INFO", "commit.txt"}
    assert not differing, f"in the archive or committed, but not both: {', '.join(sorted(differing))}"
    return f"{len(names)} files, {archive.stat().st_size / 1e6:.1f} MB"


def main(folder: str = "dist") -> None:
    """Print a line for each distribution; fail if a distribution is wrong."""
    (archive,) = Path(folder).glob("*.tar.gz")
    sys.stdout.write(f"{archive.name}: {check_archive(archive)}\n")
    for name, target in TARGETS.items():
        (wheel,) = Path(folder).glob(f"*-{target.tag}.whl")
        sys.stdout.write(f"{name}: {'; '.join(check(wheel, target))}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
