"""Identical submissions are listed, by loaded program and by source; other submissions are not."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.grading.copies import program_digest, shipped_digests, source_digest, with_copies
from fcu_emulator.emulator.grading.reports.class_page import class_page
from fcu_emulator.emulator.grading.results import Graded
from fcu_emulator.emulator.grading.submissions import SubmittedFirmware, SubmittedSource
from fcu_emulator.firmware_model import arm
from tests.grading.test_nothing_lost import no_machine
from tests.grading.test_reports import assert_harmless, graded, whole

__all__ = ["no_machine"]

SOURCE = b'int main(void)\n{\n  char *a = "x // y /* z"; /* why */\n  return a[0] - \'"\'; // end\n}\n'


def digest(**files: bytes) -> str:
    return source_digest(SubmittedSource({f"{name}.c": data for name, data in files.items()}))


@pytest.mark.parametrize(
    "same",
    [
        SOURCE.replace(b"/* why */", b""),
        SOURCE.replace(b"// end", b"/* another\n comment */"),
        b" ".join(SOURCE.replace(b"// end", b"").split()),
        SOURCE.replace(b"\n", b"\r\n"),
        SOURCE.replace(b"return", b"re\\\nturn"),
        SOURCE.replace(b" - ", b"-"),
    ],
)
def test_comments_and_layout_do_not_change_digest(same: bytes) -> None:
    assert digest(main=same) == digest(main=SOURCE) == digest(other=same, empty=b"// nothing\n")


@pytest.mark.parametrize(
    "other",
    [
        SOURCE.replace(b"// y", b""),
        SOURCE.replace(b"a[0]", b"a[1]"),
        SOURCE.replace(b"char *a", b"char *b"),
        SOURCE.replace(b" - ", b" -- "),
        SOURCE + b"int x;",
    ],
)
def test_any_change_of_code_changes_digest(other: bytes) -> None:
    assert digest(main=other) != digest(main=SOURCE)


def test_file_order_and_names_do_not_change_digest() -> None:
    assert digest(main=b"int a;", b=b"int b;") == digest(main=b"int b;", x=b"int a;")


def test_programs_are_compared_by_loaded_contents(tmp_path: Path) -> None:
    elf = arm.prebuilt("template").read_bytes()
    changed = elf.replace(b"main.c", b"MAIN.c")  # in the debug information alone
    assert changed != elf

    assert program_digest(SubmittedFirmware("a.elf", elf)) == program_digest(
        SubmittedFirmware("b.elf", changed)
    )
    assert program_digest(
        SubmittedFirmware("a.elf", arm.prebuilt("solution").read_bytes())
    ) != program_digest(SubmittedFirmware("a.elf", elf))
    assert program_digest(SubmittedFirmware("a.elf", b"a text")) == ""


def test_solution_source_digest_is_shipped() -> None:
    folder = arm.sources() / "solution"
    files = {path.name: path.read_bytes() for path in folder.glob("*.[ch]")}

    assert shipped_digests()[source_digest(SubmittedSource(files))] == "solution"


def copies(*submissions: tuple[str, str, str]) -> list[Graded]:
    return with_copies(
        (number, graded(name, source_digest=source, program_digest=program))
        for number, (name, source, program) in enumerate(submissions)
    )


def test_each_copy_lists_other_copies() -> None:
    found = copies(("ada", "s", "p"), ("bob", "s", "p"), ("eve", "", "p"), ("moe", "", ""), ("zoe", "", ""))

    assert [(one.same_source, one.same_program) for one in found] == [
        (("bob",), ("eve",)),
        (("ada",), ("eve",)),
        ((), ("ada", "bob")),
        ((), ()),
        ((), ()),
    ]


def test_submissions_of_one_team_are_not_copies() -> None:
    found = with_copies(("together", graded(name, source_digest="s")) for name in ("ada", "bob"))

    assert [one.copies for one in found] == ["", ""]


def test_class_page_lists_only_copies() -> None:
    page = assert_harmless(
        class_page(whole(*copies(("ada", "s", "p"), ("bob", "s", "q"), ("eve", "t", "r"))))
    )

    assert "Identical: 2" in page.text
    assert "same source as bob" in page.text


def test_command_lists_copies_and_shipped_programs(no_machine: None, tmp_path: Path) -> None:
    where = tmp_path / "class"
    texts = {"ada": SOURCE, "bob": SOURCE + b"// mine\n", "eve": b"int main(void) { return 7; }\n"}
    texts["moe"] = (arm.sources() / "template" / "main.c").read_bytes() + b"\n/* all my own work */\n"
    for name, text in texts.items():
        (where / name).mkdir(parents=True)
        (where / name / "main.c").write_bytes(text)
    (where / "zoe").mkdir()
    shutil.copyfile(arm.prebuilt("solution"), where / "zoe" / "lab3.elf")
    execute(
        [
            "grade",
            str(where),
            "--rubric",
            "lab3",
            "--out",
            str(tmp_path / "out"),
            "--submission-type",
            "source",
        ]
    )
    with (tmp_path / "out" / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        found = {row["id"]: row["copies"] for row in csv.DictReader(file)}
    execute(
        [
            "grade",
            str(where),
            "--rubric",
            "lab3",
            "--out",
            str(tmp_path / "out"),
            "--submission-type",
            "firmware",
        ]
    )
    with (tmp_path / "out" / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        built = {row["id"]: row["copies"] for row in csv.DictReader(file)}

    assert "same source as bob" in found["ada"]
    assert "same source as ada" in found["bob"]
    assert "template" in found["moe"]
    assert "solution" in built["zoe"]
    assert "copies" not in (tmp_path / "out" / "students" / "ada.html").read_text(encoding="utf-8")
