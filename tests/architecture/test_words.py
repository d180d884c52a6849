"""Each golden text belongs to an existing test."""

from __future__ import annotations

from tests.support.words import ROOT, keys


def test_every_golden_section_belongs_to_some_test() -> None:
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))

    assert [(file, test) for file, test in keys() if f"def {test}(" not in sources] == []
