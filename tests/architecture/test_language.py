"""The guides are in plain technical English: patterns of a private idiom stay below a rate per 10,000 words."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GENERATED = {"decisions.md", "mistakes.md"}
PATTERNS = {
    "a clause in place of a noun": (
        r"\bwhat (?:is|was|are|were|has|have|had|the|it|they|an?|you|can|does|did|would|will|must|may)\b",
        5,
    ),
    "nobody, somebody, whoever, whatever, others": (r"\b(?:nobody|somebody|whoever|whatever|others)\b", 0.5),
    "stands for is": (r"\bstands?\b", 0.5),
    "look at for read or check": (r"\blook(?:s|ed|ing)? at\b", 2),
    "where for if or when": (r"(?:^|[.;,:] )[Ww]here (?:it|there|an?|the|that|they|no|one)\b", 1),
    "of its own": (r"\bof (?:its|their|your|his|our) own\b", 1),
    "made of, made from": (r"\bmade (?:of|from)\b", 0.5),
    "go on, anew": (r"\b(?:go(?:es|ing)? on|went on|anew)\b", 0.5),
    "is no": (r"\b(?:is|are|was|were) no\b", 2),
}
"""Each pattern with the most times that it may occur in 10,000 words."""


def guides() -> str:
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages if page.name not in GENERATED)
    return re.sub(r"```.*?```|`[^`]*`", "X", text, flags=re.DOTALL)


@pytest.mark.parametrize("name", PATTERNS)
def test_pattern_is_rare_in_guides(name: str) -> None:
    pattern, most = PATTERNS[name]
    text = guides()
    found = [match.group() for match in re.finditer(pattern, text, re.MULTILINE)]

    assert 10_000 * len(found) / len(text.split()) <= most, found
