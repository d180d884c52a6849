"""The texts in docs/diagnosis.md are the output of the broken programs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.arm.broken_programs import EXPECTED, without_times

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis.md"
EXAMPLES = re.findall(r"^<!-- (\w+) -->\n```text\n(.*?)\n```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(("name", "shown"), EXAMPLES, ids=[name for name, _ in EXAMPLES])
def test_documented_example_equals_diagnosis(name: str, shown: str) -> None:
    """In the page, ``...`` replaces the rest of a text."""
    said = (EXPECTED / f"{name}.txt").read_text().rstrip("\n")
    if shown.endswith("\n..."):
        shown = shown.removesuffix("\n...")
        said = "\n".join(said.split("\n")[: shown.count("\n") + 1])

    assert without_times(shown) == without_times(said)


def test_every_text_block_of_page_is_tested() -> None:
    assert PAGE.read_text().count("```text") == len(EXAMPLES) > 10
