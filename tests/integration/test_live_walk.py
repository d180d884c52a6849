"""The steps of a student with a real ``make``: a new project, the live board, and an edit that the board loads."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli.new import create_project
from fcu_emulator.emulator.live import messages
from fcu_emulator.emulator.live.messages import SessionEvent
from fcu_emulator.emulator.live.setup import Setup
from tests.support.arm import student_programs
from tests.support.live_fakes import Page, do
from tests.support.words import Words

pytestmark = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


def make(folder: Path) -> None:
    done = subprocess.run(["make"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def edit(folder: Path, old: str, new: str) -> None:
    (file,) = (one for one in folder.rglob("*.c") if old in one.read_text(encoding="utf-8"))
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_edited_program_is_loaded_again(tmp_path: Path, words: Words) -> None:
    folder = tmp_path / "mylab"
    create_project(folder, "I2C2")
    make(folder)
    made = []

    def follow(event: SessionEvent) -> None:
        if isinstance(event, messages.State) and event.t_s >= 1.5 and not made:
            made.append(page.session.board.terminal.text)
            edit(folder, "ACC[x,y,z]", "FORCE[x,y,z]")
            make(folder)
        if isinstance(event, messages.Text) and made and "FORCE[x,y,z]" in page.session.board.terminal.text:
            page.session.stop()

    script = [(0.2, do(do="set_attitude", pitch_deg=40))]
    page = Page(Setup(folder / "lab3.elf", ideal=True), script, end_s=30, on_event=follow)
    session = page.run()
    assert "ACC[x,y,z]" in made[0]
    assert session.run_number == 2
    assert "FORCE[x,y,z]" in session.board.terminal.text
    assert session.board.world.attitude_deg([session.board.now_s])[0] == pytest.approx([0, 40, 0], abs=0.01)
    (notice,) = [one.text for one in page.of(messages.Notice)]
    words("web", notice)
