"""Names of tests are short: unit, condition and result, in at most eight words after ``test_``."""

from __future__ import annotations

import ast
from pathlib import Path

TESTS = Path(__file__).parents[1]
MOST_WORDS = 8


def names(path: Path) -> list[str]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [
        node.name for node in nodes if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]


def test_names_have_at_most_eight_words() -> None:
    found = [(path.name, name) for path in sorted(TESTS.rglob("test_*.py")) for name in names(path)]

    assert len(found) > 1000
    assert [(file, name) for file, name in found if name.count("_") > MOST_WORDS] == []
