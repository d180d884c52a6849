"""A docstring of a function says more than the name of the function."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
FEWEST_WORDS = 4


def short_docstrings() -> Iterator[str]:
    for folder in ("emulator", "sensors", "firmware_model", "fcu_emulator"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                text = ast.get_docstring(node) if isinstance(node, ast.FunctionDef) else None
                if text is not None and len(text.split()) < FEWEST_WORDS:
                    yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}: {text}"


def test_docstrings_have_at_least_four_words() -> None:
    assert list(short_docstrings()) == []
