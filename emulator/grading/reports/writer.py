"""Reports of a class in a folder.

::

    index.html          for the teacher
    grades.csv          for the learning platform
    grade.json          everything but the evidence
    junit.xml           for CI
    students/NAME.html  for each student
    evidence/NAME.json  the whole verdict, with terminal and plots
    kept/               builds, verdicts and pseudonyms for the next run
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from fcu_emulator.emulator.grading.reports.class_page import class_page
from fcu_emulator.emulator.grading.reports.machine import grades_csv, junit_xml
from fcu_emulator.emulator.grading.reports.student_page import student_page
from fcu_emulator.emulator.grading.results import Graded, GradedClass
from fcu_emulator.emulator.host.files import write_atomically


class Reports:
    """The folder of the reports. ``title``: the rubric's title. All methods raise OutputError."""

    def __init__(self, folder: Path, title: str, *, after_due_date: bool = True) -> None:
        self._folder = folder
        self._title = title
        self._after_due_date = after_due_date

    @property
    def index(self) -> Path:
        return self._folder / "index.html"

    def student(self, graded: Graded) -> Graded:
        """Write the page of a student. Return the result without evidence."""
        text = student_page(graded, self._title, after_due_date=self._after_due_date)
        write_atomically(self._folder / "students" / f"{graded.report}.html", text)
        if graded.verdict is None:
            return graded
        write_atomically(self._folder / "evidence" / f"{graded.report}.json", graded.verdict.to_json())
        return graded.model_copy(update={"verdict": graded.verdict.model_copy(update={"evidence": ()})})

    def whole(self, graded: GradedClass) -> None:
        """Write the files of the class, and remove old pages."""
        write_atomically(self._folder / "grade.json", graded.to_json())
        write_atomically(
            self._folder / "grades.csv", "\ufeff" + grades_csv(graded)
        )  # with a byte order mark, because Excel would otherwise guess the encoding
        write_atomically(self._folder / "junit.xml", junit_xml(graded))
        write_atomically(self.index, class_page(graded))
        pages = {f"{one.report}.html" for one in graded.submissions}
        evidence = {f"{one.report}.json" for one in graded.submissions if one.verdict is not None}
        for kind, current in (("students", pages), ("evidence", evidence)):
            for path in (self._folder / kind).glob("*.*"):
                if path.name not in current:
                    with suppress(OSError):
                        path.unlink()
