"""The Gradescope autograder as one zip file.

Source: https://gradescope-autograders.readthedocs.io/en/latest/specs/.

Decision: the package is a wheel of this version, because the installed files may include a C
library for another system.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.rubric import Rubric
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.host.install_hints import quoted
from fcu_emulator.emulator.scenario.loader import read_toml

_ROOT: Final = "/autograder"
_LARGEST_FILE = 64 << 20
_SETUP = """\
#!/usr/bin/env bash
# Makes the image of the autograder. Base image: Ubuntu 24.04, for its Python.
set -euo pipefail
apt-get update
apt-get install -y python3-venv make gcc-arm-none-eabi libnewlib-arm-none-eabi
python3 -m venv /opt/fcu
/opt/fcu/bin/pip install {package}
chmod 700 /autograder/source    # no compiler run for a student reads the rubric
"""
_RUN = """\
#!/usr/bin/env bash
# Grades the submission in /autograder/submission. The container is the sandbox.
set -euo pipefail
export PATH="/opt/fcu/bin:$PATH"
fcu grade --gradescope --autograder /autograder --rubric /autograder/source/rubric/{rubric} \\
    --salt /autograder/source/salt.key --bus {bus} --build-without-sandbox{take}
"""
_EPOCH = (1980, 1, 1, 0, 0, 0)  # for reproducible bytes


def write_autograder(
    file: Path, rubric: Rubric, salt: bytes, *, wheel: Path | None, bus: str, take: str | None
) -> list[str]:
    """Write the archive and return the names of its files. Raises InputError, OutputError.

    ``wheel`` is this version's wheel for Linux. If it is None, Gradescope installs the package from a package index.
    """
    package = f"fcu-emulator=={version('fcu-emulator')}"
    contents: dict[str, bytes] = {}
    if wheel is not None:
        contents[wheel.name] = _wheel(wheel)
        package = f"{_ROOT}/source/{wheel.name}"
    contents["setup.sh"] = _SETUP.format(package=quoted(package)).encode()
    taken = f" --submission-type {take}" if take else ""
    run = _RUN.format(rubric=quoted(rubric.path.name), bus=bus, take=taken)
    contents["run_autograder"] = run.encode()
    contents["salt.key"] = salt
    contents |= {f"rubric/{name}": data for name, data in _files_of(rubric).items()}
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as target:
        for name, data in contents.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, so that the permissions apply
            entry.external_attr = (0o100755 if name in ("setup.sh", "run_autograder") else 0o100644) << 16
            target.writestr(entry, data)
    write_atomically(file, sink.getvalue(), private=True)
    return list(contents)


def _wheel(file: Path) -> bytes:
    name, number, *_ = [*file.name.split("-"), "", ""]
    right = f"a wheel of fcu-emulator {version('fcu-emulator')} for Linux"
    if file.suffix != ".whl" or name != "fcu_emulator" or number != version("fcu-emulator"):
        raise InputError(f"{file} must be {right}; build it in a clone: pip wheel --no-deps .")
    if any(system in file.name for system in ("win", "macosx")):
        raise InputError(f"{file} must be {right}: Gradescope runs Linux")
    return _contents(file)


def _contents(file: Path) -> bytes:
    try:
        if file.stat().st_size > _LARGEST_FILE:
            raise InputError(f"{file} must have at most {_LARGEST_FILE >> 20} MiB")
        return file.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {file}: {error.strerror or error}") from error


def _files_of(rubric: Rubric) -> Mapping[str, bytes]:
    """Return the contents of the rubric and of all files that it needs."""
    folder = rubric.path.resolve().parent
    found: dict[str, bytes] = {}
    waiting = [rubric.path.resolve()]
    while waiting:
        path = waiting.pop()
        if not path.is_relative_to(folder):
            raise InputError(
                f"{path}: a file for Gradescope must be in the rubric's folder {folder}, or below"
            )
        name = path.relative_to(folder).as_posix()
        if name not in found:
            found[name] = _contents(path)
            waiting += _named(path) if path.suffix == ".toml" else ()
    return found


def _named(path: Path) -> Iterator[Path]:
    for text in _texts(read_toml(path, "a rubric or scenario")):
        if 0 < len(text) < 256 and "\n" not in text and "\0" not in text and "." in text:
            named = (path.parent / text).resolve()
            if named.is_file():
                yield named


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _texts(inner)
