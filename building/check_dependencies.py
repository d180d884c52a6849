"""Check that pip finds wheels of all dependencies: python building/check_dependencies.py [FOLDER]

The script refuses source distributions, because they need a compiler.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from targets import TARGETS

PYTHONS: Final = ("3.11", "3.12", "3.13", "3.14")
_ALSO: Final = {
    "manylinux2014": ("manylinux_2_27", "manylinux_2_28"),  # used by packages in C++
    "musllinux_1_2": ("musllinux_1_1",),
}


def platforms(name: str) -> list[str]:
    """Return the wheel tags that a machine of this platform accepts."""
    for family, others in _ALSO.items():
        if name.startswith(family):
            return [name, *(name.replace(family, other) for other in others)]
    return [name]


def resolve(wheel: Path, name: str, python: str) -> str:
    """Return the names of the packages. Raises RuntimeError if a package has no wheel."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "install", "-q", "--dry-run", "--ignore-installed"]
        command += ["--only-binary", ":all:", "--implementation", "cp", "--python-version", python]
        command += [word for platform in platforms(name) for word in ("--platform", platform)]
        command += ["--target", folder, "--report", f"{folder}/report.json", str(wheel)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{name}, Python {python}: {done.stderr}")
        report = Path(folder, "report.json").read_text(encoding="utf-8")
    return ", ".join(sorted(set(re.findall(r'"name": "([\w-]+)"', report)), key=str.lower))


def main(folder: str = "dist") -> None:
    """Print the packages for each platform. Raises RuntimeError if a package has no wheel."""
    for name, target in TARGETS.items():
        (wheel,) = Path(folder).glob(f"*-{target.tag}.whl")
        found = {resolve(wheel, name, python) for python in PYTHONS}
        sys.stdout.write(f"{name}, Python {PYTHONS[0]} to {PYTHONS[-1]}: {'; or '.join(found)}\n")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except RuntimeError as problem:
        sys.exit(str(problem))
