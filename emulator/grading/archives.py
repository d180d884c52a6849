"""Untrusted archives: unpack a zip file's regular files in bounded memory, time and space.

An archive is refused if it has links, devices, encrypted or duplicate files, names that lead out of
the folder, too much data, or too high a compression ratio.

Decision: entries are first counted by their signatures, because parsing a huge directory of entries
would take too much memory. ``ZipFile.extractall`` was rejected: it has no limits.
"""

from __future__ import annotations

import mmap
import os
import re
import stat
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Final

from fcu_emulator.emulator.errors import FcuError, InputError, NotJudgedError
from fcu_emulator.emulator.host.files import is_about_the_name
from fcu_emulator.emulator.text import one_line

_DIRECTORY_ENTRY = re.compile(re.escape(b"PK\x01\x02"))
_ENCRYPTED = 0x1
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_PIECE = 1 << 16
_HONEST = 1 << 20  # bytes that are allowed regardless of the ratio
_LONGEST_NAME = 240
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")  # on Windows these names open devices


class ArchiveError(InputError):
    """Reason for refusing an archive."""


@dataclass(frozen=True)
class Bounds:
    """Size limits of an archive."""

    entries: int
    bytes: int
    """Maximum bytes of the archive, and of its unpacked files."""
    ratio: float = 200.0
    """Maximum ratio of unpacked to packed size: text has about 10, an ELF file 4, a HEX file of zeros 150."""


SUBMISSION: Final = Bounds(entries=2_000, bytes=64 << 20)
CLASS: Final = Bounds(entries=100_000, bytes=4 << 30)
"""Limits for a platform's archive of all submissions."""


def unpack(archive: Path, into: Path, bounds: Bounds = SUBMISSION) -> None:
    """Write the archive's files into the new folder ``into``. Raises ArchiveError, NotJudgedError."""
    try:
        size = archive.stat().st_size
        if size > bounds.bytes:
            raise ArchiveError(f"must have at most {bounds.bytes} bytes, not {size}")
        _count_entries(archive, bounds)
        with zipfile.ZipFile(archive) as opened:
            _unpack(opened, into, bounds, packed=size)
    except (FcuError, MemoryError):
        raise
    except OSError as error:
        reason = one_line(error.strerror or str(error), 120)
        if error.errno is None or is_about_the_name(error):  # no errno if zipfile has refused the contents
            raise ArchiveError(f"cannot be unpacked: {reason}") from error
        raise NotJudgedError(f"this machine cannot unpack the archive: {reason}") from error
    except Exception as error:  # zipfile raises a dozen kinds of errors for damaged archives
        raise ArchiveError(f"is damaged or not a zip file: {one_line(str(error), 80)}") from error


def _count_entries(archive: Path, bounds: Bounds) -> None:
    if archive.stat().st_size == 0:
        raise ArchiveError("is empty")
    with archive.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as contents:
        for number, _ in enumerate(_DIRECTORY_ENTRY.finditer(contents), start=1):
            if number > bounds.entries:
                raise ArchiveError(f"must have at most {bounds.entries} files")


def _unpack(opened: zipfile.ZipFile, into: Path, bounds: Bounds, packed: int) -> None:
    into.mkdir(parents=True, exist_ok=True)
    left = bounds.bytes
    most = max(_HONEST, int(packed * bounds.ratio))
    taken: set[str] = set()
    for entry in opened.infolist():
        parts = _checked_name(entry)
        if not parts or entry.is_dir():
            continue
        key = "/".join(parts).casefold()
        if key in taken:
            raise ArchiveError(f"has {_shown(entry)} twice")
        taken.add(key)
        target = into.joinpath(*parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        with opened.open(entry) as source, target.open("xb") as sink:
            while piece := source.read(_PIECE):
                left -= len(piece)
                if left < 0:
                    raise ArchiveError(f"must unpack to at most {bounds.bytes} bytes", kind="too_large")
                if bounds.bytes - left > most:
                    problem = f"must unpack to at most {bounds.ratio:g} times its size"
                    raise ArchiveError(problem, kind="zip_bomb")
                sink.write(piece)
        _set_time(target, entry)


def _set_time(target: Path, entry: zipfile.ZipInfo) -> None:
    """Set the file's time to the time in the archive."""
    with suppress(OSError, ValueError, OverflowError):
        at = datetime(*entry.date_time).timestamp()
        os.utime(target, (at, at))


def _checked_name(entry: zipfile.ZipInfo) -> tuple[str, ...]:
    name = entry.filename.replace("\\", "/")  # some Windows programs write backslashes
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise ArchiveError(f"has {_shown(entry)}, which is a link or a device")
    if entry.flag_bits & _ENCRYPTED:
        raise ArchiveError(f"has {_shown(entry)}, which is encrypted")
    if entry.compress_type not in _COMPRESSIONS:
        raise ArchiveError(f"has {_shown(entry)} with an unsupported compression; use plain zip")
    path = PurePosixPath(name)
    if not path.parts and not name.endswith("/"):  # "./" is the archive's own folder
        raise ArchiveError("has a file without a name")
    if path.is_absolute() or PureWindowsPath(name).anchor or ".." in path.parts:
        raise ArchiveError(f"has {_shown(entry)}, a path outside of the archive", kind="leads_out")
    if len(name) > _LONGEST_NAME or any(not part.isprintable() for part in path.parts):
        raise ArchiveError(f"has {_shown(entry)}, an invalid file name")
    if any(_RESERVED.fullmatch(part) or ":" in part for part in path.parts):
        raise ArchiveError(f"has {_shown(entry)}, an invalid file name on Windows")
    return path.parts


def _shown(entry: zipfile.ZipInfo) -> str:
    return repr(one_line(entry.filename, 60))
