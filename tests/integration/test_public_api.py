"""The public API: creating, running, closing and showing a board, and the origin of names."""

from __future__ import annotations

import gc
import json
import re
import subprocess
import sys
import weakref
from pathlib import Path

import pytest

from fcu_emulator import (
    Board,
    DeviceNote,
    FcuError,
    I2CFault,
    I2CNackError,
    InputError,
    emulator,
    load_scenario,
    run,
)
from tests.support.board_fakes import script

OF_CONTRIBUTORS = {"recipes"}  # about the inside, for those who change it
DOCS = [
    page
    for page in sorted((Path(__file__).parents[2] / "docs").rglob("*.md"))
    if page.stem not in OF_CONTRIBUTORS
]
IMPORT = re.compile(r"^\s*from fcu_emulator import ([\w, ]+)$", re.MULTILINE)
# in docs/api and docs/rubrics.md
ROOMS_OF_USERS = r"adapters|chip\.gdb|testing|grading|analysis\.mistakes|analysis\.recorder"
INNARDS = re.compile(rf"^\s*from fcu_emulator\.emulator\.(?!{ROOMS_OF_USERS})[\w.]+ import", re.MULTILINE)


def scenario(folder: Path, seed: int) -> Path:
    file = folder / "seeded.toml"
    file.write_text(f'schema = 1\nquestion = "?"\nfirmware = "template"\nseed = {seed}\nduration = "2s"\n')
    return file


def test_scenario_seed_is_used_unless_another_is_given(tmp_path: Path) -> None:
    file = scenario(tmp_path, seed=5)

    assert Board(scenario=file).seed == 5
    assert Board(scenario=file, seed=0).seed == 0
    assert Board(scenario=file, seed=3).seed == 3
    assert Board().seed == 0


def test_seed_of_0_overrides_scenario(tmp_path: Path) -> None:
    file = scenario(tmp_path, seed=5)
    texts = []
    for seed in (None, 0, 5):
        board = Board(scenario=file, seed=seed)
        board.run_for(1.5)
        texts.append(board.terminal.text)

    assert texts[0] == texts[2] != texts[1]


def test_command_accepts_seed_of_0(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "fcu_emulator", "run", "--scenario", str(scenario(tmp_path, seed=5))]
    zero = subprocess.run(
        [*command, "--seed", "0", "--speed", "max"], capture_output=True, text=True, check=True
    )
    own = subprocess.run([*command, "--speed", "max"], capture_output=True, text=True, check=True)

    assert "seed 0," in zero.stderr
    assert "seed 5," in own.stderr
    assert zero.stdout != own.stdout


def test_board_arguments_are_keyword_only() -> None:
    with pytest.raises(TypeError):
        Board("lab3", "desk")  # type: ignore[misc]


def test_run_until_takes_seconds_since_power_on() -> None:
    board = Board()
    board.run_for(0.25)
    board.run_until(1.5)
    assert board.now_s == 1.5
    board.run_until(1.5)
    board.run_until(0.5)
    assert board.now_s == 1.5


@pytest.mark.parametrize("when", [-1, float("nan"), float("inf"), 10**9, "2 s", None])
def test_run_until_refuses_invalid_time(when: float) -> None:
    with pytest.raises(InputError) as refused:
        Board().run_until(when)
    assert refused.value.kind == "time"


def test_fault_is_permanent_or_has_end() -> None:
    board = Board()
    board.i2c2.inject(I2CFault("absent", from_s=0.1, until_s=0.2, address=0x1E))
    assert board.i2c2.write_read(0x1E, b"\x4f", 1) == b"\x40"
    board.run_until(0.15)
    with pytest.raises(I2CNackError):
        board.i2c2.write_read(0x1E, b"\x4f", 1)
    board.run_until(0.2)
    assert board.i2c2.write_read(0x1E, b"\x4f", 1) == b"\x40"

    board.i2c2.inject(I2CFault("absent"))
    board.run_until(3600)
    with pytest.raises(I2CNackError):
        board.i2c2.write_read(0x1E, b"\x4f", 1)


@pytest.mark.parametrize(
    ("kind", "from_s", "until_s"),
    [("lost", 0, 1), ("nack", 2, 1), ("nack", -1, 1), ("nack", float("nan"), 1)],
)
def test_impossible_fault_is_refused(kind: str, from_s: float, until_s: float) -> None:
    with pytest.raises(InputError):
        I2CFault(kind, from_s, until_s)  # type: ignore[arg-type]


def test_events_have_their_time_in_seconds() -> None:
    board = Board()
    board.run_for(0.5)
    board.i2c2.write(0x6B, b"\x10\xc0")  # no rate of the accelerometer

    (note,) = board.trace.of(DeviceNote)
    assert note.t_s == pytest.approx(0.5, abs=1e-3)


# -- the end of a board -------------------------------------------------------------------------------------


def test_repr_describes_board() -> None:
    board = Board("lab3", scenario="flat", seed=4)
    board.run_for(1.25)
    assert repr(board) == "<Board: firmware 'lab3', scenario 'flat', wiring 'lab3', seed 4, at 1.25 s>"

    bare = Board(wiring="fcu001v1")
    bare.close()
    assert repr(bare) == "<Board: no firmware, wiring 'fcu001v1', seed 0, closed>"


@pytest.mark.parametrize("firmware", [None, "lab3", "solution"])
def test_closed_board_is_readable_but_does_not_run(firmware: str | None) -> None:
    with Board(firmware) as board:
        board.run_for(1.2)
        text = board.terminal.text
    board.close()

    assert (board.now_s, board.terminal.text) == (1.2, text)
    for runs in (
        lambda: board.run_for(1),
        lambda: board.run_until(2),
        lambda: board.terminal.expect("never"),
        lambda: board.i2c2.read(0x6B, 1),
    ):
        with pytest.raises(InputError, match="closed"):
            runs()


def test_closing_ends_firmware_and_closes_trace_files(tmp_path: Path) -> None:
    ended = []

    def main(hal: object) -> None:
        try:
            while True:
                hal.HAL_Delay(10)  # type: ignore[attr-defined]
        finally:
            ended.append(True)

    with Board(script(main)) as board:
        board.trace.write_to(tmp_path / "run.jsonl")
        board.run_for(0.1)
        board.i2c2.write(0x6B, b"\x10\x50")
        assert not ended

    assert ended == [True]
    assert [json.loads(line)["kind"] for line in (tmp_path / "run.jsonl").read_text().splitlines()]


def test_board_context_closes_after_error() -> None:
    board = Board("lab3")
    with pytest.raises(InputError) as refused, board:
        board.run_for(-1)
    assert refused.value.kind == "duration"
    with pytest.raises(InputError, match="closed"):
        board.run_for(0.1)


@pytest.mark.parametrize("firmware", [None, "lab3", "solution"])
def test_unreferenced_board_is_released_immediately(firmware: str | None) -> None:
    board = Board(firmware, scenario="flat")
    board.run_for(0.1)
    watched = weakref.ref(board)
    gc.disable()
    try:
        del board
        assert watched() is None
    finally:
        gc.enable()


# -- names --------------------------------------------------------------------------------------------------


def test_every_exported_name_exists() -> None:
    assert all(getattr(emulator, name) is not None for name in emulator.__all__)
    assert set(emulator.__all__) <= set(dir(emulator))
    with pytest.raises(AttributeError, match="nonsense"):
        _ = emulator.nonsense


def test_every_error_is_importable() -> None:
    from fcu_emulator.emulator import errors

    named = {
        name for name, one in vars(errors).items() if isinstance(one, type) and issubclass(one, FcuError)
    }
    assert named <= set(emulator.__all__)


@pytest.mark.parametrize("page", DOCS, ids=lambda page: page.stem)
def test_pages_use_public_names_only(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    used = {name.strip() for names in IMPORT.findall(text) for name in names.split(",")}

    assert used <= set(emulator.__all__)
    assert not INNARDS.findall(text)


def test_public_names_suffice_to_run_a_scenario() -> None:
    plan = load_scenario("flat")
    assert run(Board("lab3", scenario=plan)).passed
