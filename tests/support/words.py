"""The exact words of the product, one golden file per command in ``tests/golden/words``.

A test asserts on kinds and data, and passes the text on: ``words("grade", done.stderr)``. The text is then compared
with the section of the test in ``tests/golden/words/grade.txt``. After a text was changed on purpose::

    pytest --update-words -n 0 TESTS

writes the sections of these tests again. Then the difference of the golden file is reviewed instead of the tests.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).parents[2]
FOLDER: Final = ROOT / "tests" / "golden" / "words"
_SECTION: Final = re.compile(r"^=== (.*)\n", re.MULTILINE)
_TEMPORARY: Final = re.compile(
    r"[^\s'\"=(]*pytest-of-[^\\/\s]+[\\/]pytest-\d+[\\/](?:popen-gw\d+[\\/])?[^\\/\s'\":,;)]+"
)
_FOLDERS: Final = re.compile(r"(?:TMP|ROOT)\\[^\s'\":,;)]+")


class Words:
    """Comparison of the texts of one test with their sections; each call of a test has a separate section."""

    def __init__(self, request: pytest.FixtureRequest) -> None:
        self._update = bool(request.config.getoption("--update-words"))
        node = request.node
        case = getattr(node, "callspec", None)
        numbers = "-".join(str(one) for one in case.indices.values()) if case else ""
        self._name = f"{node.path.stem}::{node.originalname}" + (f"[{numbers}]" if numbers else "")
        self._calls = 0

    def __call__(self, command: str, text: str) -> None:
        """Assert that ``text`` is the golden text. Paths that depend on the machine are replaced before."""
        self._calls += 1
        key = self._name if self._calls == 1 else f"{self._name} {self._calls}"
        text = neutral(text)
        path = FOLDER / f"{command}.txt"
        known = sections(path)
        if self._update and known.get(key) != text:
            known[key] = text
            FOLDER.mkdir(exist_ok=True)
            path.write_text(
                "".join(f"=== {name}\n{known[name]}\n" for name in sorted(known)),
                encoding="utf-8",
                newline="\n",
            )
        assert text == known.get(key), f"{path.name}, {key}: to accept the words: pytest --update-words -n 0"


def neutral(text: str) -> str:
    """Return the text without the paths and slashes of this machine, and without blanks at its end."""
    text = _TEMPORARY.sub("TMP", text)
    text = text.replace(sys.executable, "PYTHON").replace(str(ROOT), "ROOT").rstrip()
    return _FOLDERS.sub(lambda path: path[0].replace("\\", "/"), text)  # as on Windows


def sections(path: Path) -> dict[str, str]:
    """Return the texts of a golden file by their keys."""
    if not path.is_file():
        return {}
    _, *parts = _SECTION.split(path.read_text(encoding="utf-8"))
    return dict(zip(parts[::2], (text[:-1] for text in parts[1::2]), strict=True))


def keys() -> Iterator[tuple[str, str]]:
    """Yield each golden file's name with each test that has a section in it."""
    for path in sorted(FOLDER.glob("*.txt")):
        for key in sections(path):
            yield path.name, re.split(r"[\[ ]", key.partition("::")[2])[0]
