"""A session continues with any message of a page and after any failure of the machine; the page gets a notice."""

from __future__ import annotations

import base64
import errno
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.errors import FirmwareFileError, InputError, OutputError
from fcu_emulator.emulator.links import MemoryLink
from fcu_emulator.emulator.links.control import ControlServer
from fcu_emulator.emulator.live import messages
from fcu_emulator.emulator.live.files import UploadedFile
from fcu_emulator.emulator.live.messages import (
    LARGEST_FIRMWARE,
    LONGEST_COMMAND,
    LONGEST_UPLOAD,
    MessageError,
    PageCommand,
)
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.live_fakes import Page, do
from tests.support.scenario_files import HEAD, write

FULL = OSError(errno.ENOSPC, "No space left on device")
FAILURES = [
    FULL,
    MemoryError(),
    OutputError("output"),
    InputError("input"),
    KeyError("a bug"),
    RecursionError(),
]
FIRMWARE = base64.b64encode(prebuilt("solution", "I2C2").read_bytes()).decode()
UPLOAD = messages.Upload("lab3.elf", FIRMWARE)


def failing(error: Exception) -> Callable[..., Any]:
    def fail(*_arguments: object, **_named: object) -> None:
        raise error

    return fail


def errors(page: Page) -> list[str]:
    return [notice.text for notice in page.of(messages.Notice) if notice.kind == "error"]


@pytest.mark.parametrize("error", FAILURES, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize(
    ("where", "name", "command"),
    [
        (tempfile, "TemporaryDirectory", UPLOAD),
        (Path, "write_bytes", UPLOAD),
        (messages.Upload, "content", UPLOAD),
        (Setup, "power_on", messages.Reset()),
        (Setup, "power_on", messages.FirmwareCommand("lab3")),
        (Setup, "power_on", messages.Play("flat")),
        (LiveSession, "_perform", do(do="tap")),
        (LiveSession, "_step", messages.StepCommand("tick")),
    ],
)
def test_failed_command_causes_notice(
    monkeypatch: pytest.MonkeyPatch, error: Exception, where: Any, name: str, command: PageCommand
) -> None:
    page = Page(Setup("lab3"), [(0.02, command)], end_s=0.1)
    monkeypatch.setattr(where, name, failing(error))
    session = page.run()
    assert session.board.now_s >= 0.1
    assert session.run_number == 1
    assert len(errors(page)) == 1
    assert errors(page)[0].isprintable()


def test_upload_that_cannot_be_written_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(Path, "write_bytes", failing(FULL))
    with pytest.raises(OSError, match="No space"):
        UploadedFile("lab3.elf", b"")
    assert list(tmp_path.iterdir()) == []


def test_upload_after_failed_upload_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = messages.Upload("broken.elf", "")
    page = Page(Setup("lab3"), [(0.02, broken), (0.04, UPLOAD), (0.06, do(do="tap"))], end_s=0.1)
    session = page.run()
    assert session.run_number == 2
    assert page.of(messages.StatusEvent)[-1].firmware == "lab3.elf"
    assert len(errors(page)) == 1


@pytest.mark.parametrize("error", FAILURES, ids=lambda error: type(error).__name__)
def test_failing_view_or_link_does_not_end_session(error: Exception) -> None:
    link = MemoryLink()
    page = Page(Setup("lab3"), end_s=1e9, links=[link])
    link.send = failing(error)  # type: ignore[method-assign]
    turns: list[int] = []

    def count(*_arguments: object) -> None:
        turns.append(1)
        if len(turns) > 100:
            page.session.stop()
        raise error

    page.session._broadcast.show = count  # type: ignore[method-assign]
    page.run()
    assert page.session.board.now_s > 0
    assert len(set(errors(page))) == 1


@pytest.mark.parametrize("error", FAILURES, ids=lambda error: type(error).__name__)
def test_failed_board_can_be_reset(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def fail_once(board: Board, at_ps: int) -> None:
        monkeypatch.setattr(Board, "run_until_ps", run_until_ps)
        raise error

    run_until_ps = Board.run_until_ps
    page = Page(Setup("lab3"), [(0.0, messages.Reset())], end_s=0.1)
    monkeypatch.setattr(Board, "run_until_ps", fail_once)
    session = page.run()
    states = [status.state for status in page.of(messages.StatusEvent)]
    assert "failed" in states
    assert states[-1] == "running"
    assert session.run_number == 2


def test_recording_on_full_disk_refuses_reset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = tmp_path / "session.toml"
    page = Page(Setup("lab3"), [(0.02, messages.Reset())], end_s=0.1, record=record)
    monkeypatch.setattr(tempfile, "mkstemp", failing(FULL))
    with pytest.raises(OutputError):
        page.run()
    assert page.session.run_number == 1
    assert len(errors(page)) == 1
    assert not record.exists()


def test_session_end_removes_upload_although_recording_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    page = Page(Setup("lab3"), [(0.02, UPLOAD)], end_s=0.1, record=tmp_path / "no" / "session.toml")
    monkeypatch.setattr("fcu_emulator.emulator.live.recording.write_atomically", failing(OutputError("full")))
    with pytest.raises(OutputError):
        page.run()
    assert list(tmp_path.iterdir()) == []


def test_impossible_scenario_fails_board(tmp_path: Path) -> None:
    """The scenario lifts the board by 2 km and the hand holds it at 9 km, but the limit of the world is 10 km."""
    lifts = '[[timeline]]\nat = "100ms"\ndo = "lift"\nmetres = 2000\nfor = "10s"\n'
    scenario = write(tmp_path, HEAD + 'duration = "1s"\n' + lifts)
    script = [(0.01, do(do="follow_altitude", metres=9000, time_constant="1ms"))]
    page = Page(Setup("lab3", str(scenario)), script, end_s=0.2)
    page.run()
    status = page.of(messages.StatusEvent)[-1]
    assert status.state == "failed"
    assert "10000 m" in status.problem


def test_control_failure_does_not_end_session() -> None:
    page = Page(Setup("lab3"), end_s=0.1)

    class Broken(ControlServer):
        def __init__(self) -> None:
            """Raise an error, because there is no port."""

        def serve(self) -> None:
            raise FULL

    page.session.control = Broken()
    assert page.run().board.now_s >= 0.1


# -- Messages -----------------------------------------------------------------------------------------------


def test_upload_is_recognised_by_its_type() -> None:
    content = "A" * (2 * LONGEST_COMMAND)
    table = {"type": "upload", "name": "a.bin", "data": content}
    spaced = json.dumps(table)
    for text in (
        spaced,
        json.dumps(table, separators=(",", ":")),
        json.dumps(table, indent=2),
        json.dumps(dict(reversed(table.items()))),
        f" \n{spaced}\n",
    ):
        assert messages.decode(text) == messages.Upload("a.bin", content)


@pytest.mark.parametrize(
    "text",
    [
        '{"type":"upload",' + '"x":[' + "[]," * LONGEST_COMMAND + "[]]}",
        '{"type":"upload","name":"a.bin","data":"' + "A" * LONGEST_UPLOAD + '"}',
        '{"type":"record","x":"' + "A" * LONGEST_COMMAND + '"}',
        json.dumps({"type": "do", "entry": {"do": "send", "text": "A" * LONGEST_COMMAND}}),
        "[" * LONGEST_UPLOAD,
        "{}" * LONGEST_COMMAND,
        "1" * LONGEST_UPLOAD,
        '"' * (2 * LONGEST_COMMAND),
    ],
    ids=["values", "longer", "record", "do", "depth", "objects", "digits", "quotes"],
)
def test_long_message_without_upload_is_refused(text: str) -> None:
    with pytest.raises(MessageError) as refused:
        messages.decode(text)
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 300


def test_largest_firmware_can_be_uploaded() -> None:
    data = base64.b64encode(bytes(LARGEST_FIRMWARE)).decode()
    command = messages.decode(json.dumps({"type": "upload", "name": "x" * 190 + ".elf", "data": data}))
    assert isinstance(command, messages.Upload)
    assert len(command.content()) == LARGEST_FIRMWARE


def test_names_of_uploads_are_made_printable_for_page() -> None:
    name = "\x1b]0;x\x07\u202egnp.elf"
    page = Page(Setup("lab3"), [(0.02, messages.Upload(name, FIRMWARE)), (0.04, do(do="tap"))], end_s=0.1)
    page.run()
    (notice,) = page.of(messages.Notice)
    assert notice.text.isprintable()
    assert page.of(messages.StatusEvent)[-1].firmware.isprintable()
    assert messages.Notice("error", str(FirmwareFileError(name, "no"))).text.isprintable()


def test_number_of_waiting_uploads_is_limited() -> None:
    session = Page(Setup("lab3"), end_s=0.1).session
    taken = [session.post(None, UPLOAD) for _ in range(10)]
    assert taken == [True, True, *[False] * 8]
    assert session.post(None, messages.Pause())
