"""A small class: bad submissions affect only themselves. class_of_forty.py has the whole class."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.campaigns import class_of_forty, class_of_layouts
from tests.grading.test_build import needs_compiler, needs_sandbox
from tests.grading.test_grade import RUBRIC
from tests.grading.test_nothing_lost import no_machine
from tests.grading.test_reports import assert_harmless

__all__ = ["no_machine"]


@needs_compiler
@needs_sandbox
def test_hostile_submissions_affect_only_their_own_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "little.toml").write_text(RUBRIC, encoding="utf-8")
    class_of_forty.write_hostile(tmp_path / "submissions")
    before = set(tmp_path.iterdir())
    whole = class_of_forty.grade(tmp_path / "submissions", tmp_path / "out", str(tmp_path / "little.toml"))
    points = {one.id: one.points for one in whole.submissions}
    reasons = {one.id: one.reason for one in whole.submissions if one.status == "rejected"}

    assert set(tmp_path.iterdir()) - before == {tmp_path / "out"}
    assert points.pop("writes markup and escape sequences") == 3
    assert {name for name, got in points.items() if got == 0} == class_of_forty.JUDGED.keys() & points.keys()
    assert reasons.keys() == class_of_forty.REJECTED.keys()
    for name, words in class_of_forty.REJECTED.items():
        assert words in reasons[name]
    for page in (tmp_path / "out").rglob("*.html"):
        found = assert_harmless(page.read_text(encoding="utf-8"))
        assert "root:" not in found.text
    evil = (tmp_path / "out" / "students").glob("writes-markup*.html")
    assert (
        "<script>document.title = 1</script>\\x1b[2J\\x1b]0;owned\\x07</pre>"
        in assert_harmless(next(evil).read_text(encoding="utf-8")).text
    )


def test_class_of_forty_loses_no_file(
    no_machine: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    class_of_layouts.main(tmp_path)
    said = [line for line in capsys.readouterr().out.splitlines() if "accounted for" in line]

    assert [line.partition(":")[0] for line in said] == list(class_of_layouts.GRADED)
    assert all("1 late" in line for line in said)
