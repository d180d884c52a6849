"""Check that all files name the same version: python building/check_version.py [REF]

``CITATION.cff``, ``CHANGELOG.md`` and a tag REF (refs/tags/v0.2.0) must have the version of ``pyproject.toml``.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
_TAG: Final = "refs/tags/"


def problems(root: Path, ref: str = "") -> Iterator[str]:
    """Yield a line for each file with a different version."""
    version = tomllib.loads(_text(root / "pyproject.toml"))["project"]["version"]
    cited = re.findall(r"^version: (\S+)$", _text(root / "CITATION.cff"), re.MULTILINE)
    if cited != [version]:
        yield f"the version of CITATION.cff must be {version}, not {', '.join(cited) or 'missing'}"
    if not re.search(rf"^## {re.escape(version)}\b", _text(root / "CHANGELOG.md"), re.MULTILINE):
        yield f"CHANGELOG.md must have a section {version}; run towncrier build --version {version}"
    if ref.startswith(_TAG) and ref != f"{_TAG}v{version}":
        yield f"the tag must be v{version}, not {ref.removeprefix(_TAG)}"


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


if __name__ == "__main__":
    sys.exit("\n".join(problems(ROOT, *sys.argv[1:])) or None)
