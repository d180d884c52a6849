"""Untrusted archives: valid archives are unpacked, invalid archives are refused with a reason."""

from __future__ import annotations

import io
import shutil
import stat
import struct
import zipfile
from pathlib import Path

import pytest

from fcu_emulator.emulator.grading.archives import ArchiveError, Bounds, unpack

SMALL = Bounds(entries=10, bytes=1 << 20)


def archive(path: Path, **files: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name, data in files.items():
            target.writestr(name, data)
    return path


def one(path: Path, entry: zipfile.ZipInfo, data: bytes = b"int x;") -> Path:
    with zipfile.ZipFile(path, "w") as target:
        target.writestr(entry, data)
    return path


def reason(path: Path, bounds: Bounds = SMALL) -> str:
    into = path.parent / "into"
    shutil.rmtree(into, ignore_errors=True)
    with pytest.raises(ArchiveError) as refused:
        unpack(path, into, bounds)
    outside = {each for each in path.parent.rglob("*") if into not in (each, *each.parents)}
    assert outside == {path}
    return str(refused.value)


def test_files_and_folders_are_unpacked(tmp_path: Path) -> None:
    file = archive(tmp_path / "a.zip", **{"lab/main.c": b"int main;", "lab/src/x.h": b"", "lab/": b""})

    unpack(file, tmp_path / "into", SMALL)

    assert (tmp_path / "into/lab/main.c").read_bytes() == b"int main;"
    assert (tmp_path / "into/lab/src/x.h").read_bytes() == b""


def test_backslashes_in_archives_are_separators(tmp_path: Path) -> None:
    entry = zipfile.ZipInfo("x")
    entry.filename = "lab\\main.c"
    file = one(tmp_path / "a.zip", entry)

    unpack(file, tmp_path / "into", SMALL)

    assert (tmp_path / "into/lab/main.c").is_file()


@pytest.mark.parametrize(
    "name",
    ["../main.c", "a/../../main.c", "/tmp/main.c", "C:\\main.c", "..\\main.c", "\\\\host\\share\\main.c"],
)
def test_name_outside_folder_is_refused(name: str, tmp_path: Path) -> None:
    entry = zipfile.ZipInfo("x")
    entry.filename = name

    assert "outside of the archive" in reason(one(tmp_path / "a.zip", entry))


@pytest.mark.parametrize("name", ["a\nb.c", "\x1b[31m.c", "con", "LPT1.c", "ab:c.c", "x" * 250 + ".c"])
def test_name_invalid_on_any_system_is_refused(name: str, tmp_path: Path) -> None:
    words = reason(one(tmp_path / "a.zip", zipfile.ZipInfo(name)))

    assert "an invalid file name" in words
    assert words.isprintable()


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFCHR, stat.S_IFBLK, stat.S_IFIFO])
def test_links_and_devices_are_refused(kind: int, tmp_path: Path) -> None:
    entry = zipfile.ZipInfo("main.c")
    entry.create_system = 3
    entry.external_attr = (kind | 0o777) << 16

    assert "link or a device" in reason(one(tmp_path / "a.zip", entry, b"/etc/passwd"))


def test_duplicate_file_is_refused_ignoring_case(tmp_path: Path) -> None:
    assert "twice" in reason(archive(tmp_path / "a.zip", **{"main.c": b"1", "MAIN.c": b"2"}))


def test_too_many_files_are_refused_before_parsing(tmp_path: Path) -> None:
    file = archive(tmp_path / "a.zip", **{f"{number}.c": b"" for number in range(11)})

    assert reason(file) == "must have at most 10 files"


def test_zip_bomb_is_refused_for_ratio_and_size(tmp_path: Path) -> None:
    file = archive(tmp_path / "a.zip", bomb=bytes(64 << 20))

    assert "at most 200 times its size" in reason(file, Bounds(entries=10, bytes=1 << 30))
    assert "at most 1048576 bytes" in reason(file)


def test_declared_size_is_not_trusted(tmp_path: Path) -> None:
    """The directory states a small size, but the archive unpacks to a large size."""
    file = archive(tmp_path / "a.zip", bomb=bytes(2 << 20))
    data = bytearray(file.read_bytes())
    at = data.rindex(b"PK\x01\x02")
    data[at + 24 : at + 28] = struct.pack("<I", 5)
    file.write_bytes(data)

    with pytest.raises(ArchiveError):
        unpack(file, tmp_path / "into", SMALL)
    assert sum(path.stat().st_size for path in (tmp_path / "into").rglob("*") if path.is_file()) <= 1 << 20


def test_encrypted_archive_is_refused(tmp_path: Path) -> None:
    file = archive(tmp_path / "a.zip", **{"main.c": b"1"})
    data = bytearray(file.read_bytes())
    data[data.rindex(b"PK\x01\x02") + 8] |= 1
    file.write_bytes(data)

    assert "encrypted" in reason(file)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_unusual_packing_is_refused(method: int, tmp_path: Path) -> None:
    entry = zipfile.ZipInfo("main.c")
    entry.compress_type = method

    assert "unsupported compression" in reason(one(tmp_path / "a.zip", entry))


@pytest.mark.parametrize("data", [b"", b"hello", b"PK\x03\x04" + bytes(30), b"PK\x05\x06" + b"\xff" * 18])
def test_non_archive_is_refused(data: bytes, tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    file.write_bytes(data)

    assert reason(file).isprintable()


def test_truncated_archive_is_refused_or_unpacked_completely(tmp_path: Path) -> None:
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as target:
        target.writestr("main.c", b"int main(void) { return 0; }\n" * 20)
    for length in range(len(sink.getvalue())):
        file = tmp_path / f"{length}.zip"
        file.write_bytes(sink.getvalue()[:length])
        with pytest.raises(ArchiveError):
            unpack(file, tmp_path / str(length), SMALL)
