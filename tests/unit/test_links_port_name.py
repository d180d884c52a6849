"""The stable name of the pseudo-terminal: claiming, refusing, and removal of files."""

from __future__ import annotations

import contextlib
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

import fcu_emulator.emulator.errors
from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links import ByteLink, open_link

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")

SOURCES = Path(fcu_emulator.emulator.errors.__file__).parents[1]


@pytest.fixture
def port(tmp_path: Path) -> Path:
    return tmp_path / "board"


@pytest.fixture
def link(port: Path) -> Iterator[ByteLink]:
    link = open_link(f"pty:{port}")
    yield link
    link.close()


def test_announcement_shows_port_and_commands_to_paste(tmp_path: Path) -> None:
    port = tmp_path / "my board"
    with contextlib.closing(open_link(f"pty:{port}")) as link:
        first, *commands = link.announce()
        assert f"{port} ({port.readlink()})" in first
    assert commands == [
        f"  fcu terminal '{port}'",
        f"  screen '{port}' 115200",
        f"  minicom -D '{port}' -b 115200",
        f"  {sys.executable} -m serial.tools.miniterm '{port}' 115200",
        f"  putty -serial '{port}' -sercfg 115200,8,n,1,N",
    ]


def test_default_names_are_numbered_in_private_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    directory = tmp_path / "fcu-emulator"
    with contextlib.closing(open_link("pty")) as first, contextlib.closing(open_link("pty")) as second:
        assert stat.S_IMODE(directory.stat().st_mode) == 0o700
        assert str(directory / "ttyFCU0") in first.announce()[0]
        assert str(directory / "ttyFCU1") in second.announce()[0]
        first.close()
        with contextlib.closing(open_link("pty")) as third:
            assert str(directory / "ttyFCU0") in third.announce()[0]
    assert list(directory.iterdir()) == []


def test_temporary_directory_is_used_without_runtime_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with contextlib.closing(open_link("pty")):
        assert (tmp_path / f"fcu-emulator-{os.geteuid()}" / "ttyFCU0").is_char_device()


def test_symbolic_link_as_directory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "fcu-emulator").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(LinkError, match="fcu-emulator") as caught:
        open_link("pty")
    assert caught.value.kind == "foreign_folder"


def test_name_of_killed_board_is_taken_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    die = "import os; from fcu_emulator.emulator.links import open_link; open_link('pty'); os._exit(9)"
    assert subprocess.run([sys.executable, "-c", die], cwd=SOURCES, check=False).returncode == 9
    port = tmp_path / "fcu-emulator" / "ttyFCU0"
    assert port.is_symlink()
    with contextlib.closing(open_link("pty")) as link:
        assert str(port) in link.announce()[0]
        with serial.Serial(str(port), 115200, timeout=0) as device:
            assert device.is_open
    assert not port.is_symlink()


def test_stale_link_to_another_terminal_is_taken_over(port: Path) -> None:
    port.symlink_to("/dev/null")  # exists, as a terminal number that is in use again would
    with contextlib.closing(open_link(f"pty:{port}")):
        assert port.readlink() != Path("/dev/null")


def test_name_of_running_board_is_refused(link: ByteLink, port: Path) -> None:
    with pytest.raises(LinkError) as caught:
        open_link(f"pty:{port}")
    assert caught.value.kind == "name_in_use"
    assert port.is_char_device()


def test_replaced_link_is_kept_on_close(link: ByteLink, port: Path) -> None:
    port.unlink()
    port.write_text("mine")
    link.close()
    assert port.read_text() == "mine"


@pytest.mark.parametrize("kind", ["file", "directory", "link"])
def test_existing_file_is_never_replaced_by_link(kind: str, port: Path, tmp_path: Path) -> None:
    if kind == "file":
        port.write_text("precious")
    elif kind == "directory":
        port.mkdir()
    else:
        port.symlink_to(tmp_path)
    before = port.lstat()
    with pytest.raises(LinkError) as caught:
        open_link(f"pty:{port}")
    assert caught.value.kind == "not_a_terminal"
    assert port.lstat() == before
    assert list(tmp_path.iterdir()) == [port]


def test_relative_name_survives_change_of_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with contextlib.closing(open_link("pty:board")):
        monkeypatch.chdir("/")
    assert list(tmp_path.iterdir()) == []


def test_missing_directory_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"nowhere/board: No such file or directory") as caught:
        open_link(f"pty:{tmp_path}/nowhere/board")
    assert caught.value.kind == "cannot_create"
    assert "\n" not in str(caught.value)
