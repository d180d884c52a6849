"""Guides, docstrings and comments are in plain technical English.

Patterns of a private idiom must occur at most so many times in 10,000 words; pages of well-known projects have such rates.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip import native

ROOT = Path(__file__).parents[2]
GENERATED = {"decisions.md", "mistakes.md"}
PRODUCT = ("emulator", "sensors", "firmware_model", "fcu_emulator")
PATTERNS = {
    "a clause in place of a noun": (
        r"\bwhat (?:is|was|are|were|has|have|had|the|it|they|an?|you|can|does|did|would|will|must|may)\b",
        5,
    ),
    "nobody, somebody, whoever, whatever": (r"\b(?:nobody|somebody|whoever|whatever)\b", 1),
    "stands for is": (r"\bstands?\b", 0.5),
    "look at for read or check": (r"\blook(?:s|ed|ing)? at\b", 2),
    "where for if or when": (r"(?:^|[.;,:] )[Ww]here (?:it|there|an?|the|that|they|no|one)\b", 1),
    "of its own": (r"\bof (?:its|their|your|his|our) own\b", 1),
    "made of, made from": (r"\bmade (?:of|from)\b", 0.5),
    "go on, anew": (r"\b(?:go(?:es|ing)? on|went on|anew)\b", 0.5),
    "is no": (r"\b(?:is|are|was|were) no\b", 2),
}
"""Each pattern with the most times that it may occur in 10,000 words."""


def product_files() -> Iterator[Path]:
    for folder in PRODUCT:
        yield from sorted((ROOT / folder).rglob("*.py"))


@cache
def guides() -> str:
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages if page.name not in GENERATED)
    return re.sub(r"```.*?```|`[^`]*`", "X", text, flags=re.DOTALL)


@cache
def docstrings() -> str:
    """Return the strings of all files that are statements: docstrings, and descriptions of attributes."""
    found = []
    for path in product_files():
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        statements = (node.value for node in nodes if isinstance(node, ast.Expr))
        found += [str(value.value) for value in statements if isinstance(value, ast.Constant)]
    return "\n".join(found)


@cache
def comments() -> str:
    found = []
    for path in product_files():
        source = io.StringIO(path.read_text(encoding="utf-8"))
        found += [
            token.string
            for token in tokenize.generate_tokens(source.readline)
            if token.type == tokenize.COMMENT
        ]
    for path in native.sources():
        found += re.findall(r"/\*.*?\*/", path.read_text(encoding="utf-8"), re.DOTALL)
    return "\n".join(found)


@pytest.mark.parametrize("text_of", [guides, docstrings, comments], ids=lambda one: one.__name__)
@pytest.mark.parametrize("name", PATTERNS)
def test_pattern_is_rare(name: str, text_of: Callable[[], str]) -> None:
    pattern, most = PATTERNS[name]
    text = text_of()
    found = [match.group() for match in re.finditer(pattern, text, re.MULTILINE)]

    assert 10_000 * len(found) / len(text.split()) <= most, found
