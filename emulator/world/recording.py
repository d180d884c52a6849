"""CSV recordings: measured signals (board axes), or attitude and position to follow (world axes).

Columns may have any order; each group may be omitted::

    t_s, ax_g,ay_g,az_g, gx_dps,gy_dps,gz_dps, mx_uT,my_uT,mz_uT, p_hPa, temp_C
    t_s, roll_deg,pitch_deg,yaw_deg, north_m,east_m, alt_m

The time must increase from row to row. Values between rows are interpolated linearly (attitude: by the
shortest arc; position: by a smooth curve). The first row's values also apply to earlier times, and the last
row's values to later times.

Decision: recordings have a separate, strict reader, so that errors name the file and the line.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import BinaryIO, NoReturn

import numpy as np

from fcu_emulator.emulator.errors import RecordingError
from fcu_emulator.emulator.world import limits
from fcu_emulator.emulator.world.limits import Range
from fcu_emulator.emulator.world.magnetism import MGAUSS_PER_UT
from fcu_emulator.emulator.world.position import accelerations
from fcu_emulator.emulator.world.track import Array

MAX_BYTES = 64 * 1024 * 1024
MAX_ROWS = 2_000_000
MAX_NUMBERS = 10_000_000  # 80 MB of doubles, and up to 160 MB more while they are sorted
MAX_LINE_BYTES = 4096

MEASURED: dict[str, tuple[tuple[str, ...], Range]] = {
    "acc": (("ax_g", "ay_g", "az_g"), limits.SPECIFIC_FORCE),
    "gyro": (("gx_dps", "gy_dps", "gz_dps"), limits.RATE),
    "mag": (("mx_uT", "my_uT", "mz_uT"), limits.FIELD),
    "pressure": (("p_hPa",), limits.PRESSURE),
    "temperature": (("temp_C",), limits.TEMPERATURE),
}
FOLLOWED: dict[str, tuple[tuple[str, ...], Range]] = {
    "attitude": (("roll_deg", "pitch_deg", "yaw_deg"), limits.ANGLE),
    "place": (("north_m", "east_m"), limits.WAY),
    "altitude": (("alt_m",), limits.ALTITUDE),
}
GROUPS = {**MEASURED, **FOLLOWED}


@dataclass(frozen=True, eq=False)
class Recording:
    """Rows at ``t_s`` (M,) and groups, keyed by name, (M, 3) or (M,), in g, deg/s, mgauss, hPa, degC, deg, m."""

    file: str
    t_s: Array
    groups: dict[str, Array]

    @cached_property
    def coordinates(self) -> dict[str, tuple[Array, Array]]:
        """Position and acceleration at the rows, each (M,), by direction. Raises `RecordingError` for fast motion."""
        rows_m: dict[str, tuple[Array, str]] = {}
        if "place" in self.groups:
            north, east = self.groups["place"].T
            rows_m |= {"north": (north, "north_m"), "west": (-east, "east_m")}
        if "altitude" in self.groups:
            rows_m["up"] = self.groups["altitude"], "alt_m"
        return {
            direction: (row_m, self._accelerations(name, row_m))
            for direction, (row_m, name) in rows_m.items()
        }

    def _accelerations(self, name: str, row_m: Array) -> Array:
        row_m_s2 = accelerations(self.t_s, row_m)
        bad = np.abs(row_m_s2) > limits.CLIMB.high
        if bad.any():
            row = int(bad.argmax())
            found = f"{name} accelerates by {abs(row_m_s2[row]):.0f} m/s2"
            raise RecordingError(
                self.file, row + 2, f"{found}, more than {limits.CLIMB}; smooth it or omit it", kind="climb"
            )
        return row_m_s2


@dataclass(frozen=True, eq=False)
class Interpolation:
    """The rows of a group as a signal, which is linear between rows. Replays share the arrays."""

    row_s: Array  # (M,), strictly increasing
    values: Array  # (M,) or (M, 3)
    start_s: float

    def __call__(self, t_s: Array) -> Array:
        t_s = t_s - self.start_s
        if self.values.ndim == 1:
            return np.interp(t_s, self.row_s, self.values)
        return np.stack([np.interp(t_s, self.row_s, column) for column in self.values.T], axis=1)


def load_recording(path: str | PathLike[str], name: str = "") -> Recording:
    """Read a CSV file. Raises `RecordingError` with the file (``name``, or its path) and the line."""
    file = name or str(path)
    try:
        _check_size(Path(path), file)
        with Path(path).open("rb") as stream:
            lines = _lines(stream, file)
            names = _header(next(lines, b""), file)
            table = _rows(lines, names, file)
    except OSError as error:
        raise RecordingError(
            file, 0, f"cannot read the recording: {error.strerror or error}", kind="unreadable"
        ) from error
    column = dict(zip(names, table.T, strict=True))
    _check_range(column["t_s"], "t_s", limits.TIME, file)
    _check_time(column["t_s"], file)
    groups = {}
    for group, (members, allowed) in GROUPS.items():
        if members[0] in column:
            for member in members:
                _check_range(column[member], member, allowed, file)
            groups[group] = np.stack([column[member] for member in members], axis=1)
    return Recording(file, column["t_s"].copy(), _in_our_units(groups))


def _check_size(path: Path, file: str) -> None:
    if path.exists() and not path.is_file():  # a pipe or a terminal would block
        raise RecordingError(file, 0, "must be a regular file", kind="not_a_file")
    if path.stat().st_size > MAX_BYTES:
        raise RecordingError(
            file,
            0,
            f"must have at most {MAX_BYTES // 2**20} MiB; shorten it or thin its rows",
            kind="too_large",
        )


def _lines(stream: BinaryIO, file: str) -> Iterator[bytes]:
    number = 0
    while line := stream.readline(MAX_LINE_BYTES + 1):
        number += 1
        if len(line) > MAX_LINE_BYTES:
            raise RecordingError(
                file,
                number,
                f"must have at most {MAX_LINE_BYTES} bytes as a line of a CSV recording",
                kind="long_line",
            )
        yield line


def _header(line: bytes, file: str) -> list[str]:
    line = line.removeprefix(b"\xef\xbb\xbf")  # byte order mark of Excel's UTF-8
    text = line.decode("ascii", errors="backslashreplace").strip()
    if not text:
        raise RecordingError(
            file, 1, "must have a header with the names of the columns, such as t_s,p_hPa", kind="no_header"
        )
    names = [name.strip() for name in text.split(",")]
    known = {"t_s"}.union(*(members for members, _ in GROUPS.values()))
    for name in names:
        if name not in known:
            names_known = ", ".join(sorted(known))
            raise RecordingError(
                file, 1, f"unknown column '{_visible(name)}'; known: {names_known}", kind="unknown_column"
            )
        if names.count(name) > 1:
            raise RecordingError(file, 1, f"column {name} appears twice", kind="column_twice")
    if "t_s" not in names:
        raise RecordingError(file, 1, "column t_s is missing", kind="missing_column")
    _check_groups(set(names), file)
    return names


def _check_groups(names: set[str], file: str) -> None:
    for members, _ in GROUPS.values():
        missing = [name for name in members if name not in names]
        if missing and len(missing) < len(members):
            together = ", ".join(members)
            raise RecordingError(
                file,
                1,
                f"column {missing[0]} is missing; give {together} together",
                kind="incomplete_group",
            )
    measured = any(members[0] in names for members, _ in MEASURED.values())
    followed = any(members[0] in names for members, _ in FOLLOWED.values())
    if measured and followed:
        raise RecordingError(
            file,
            1,
            "must have either measured signals or attitude and position, not both",
            kind="mixed_columns",
        )
    if not measured and not followed:
        raise RecordingError(file, 1, "must have a column beside t_s", kind="no_column")


def _rows(lines: Iterator[bytes], names: list[str], file: str) -> Array:
    values = array("d")
    for number, line in enumerate(lines, start=2):
        if number - 1 > MAX_ROWS:
            raise RecordingError(
                file, number, f"must have at most {MAX_ROWS} rows; thin them", kind="too_many_rows"
            )
        if len(values) > MAX_NUMBERS:
            raise RecordingError(
                file,
                number,
                f"exceeds the limit of {MAX_NUMBERS} numbers; thin the rows",
                kind="too_many_numbers",
            )
        cells = line.split(b",")
        if len(cells) != len(names):
            raise RecordingError(
                file,
                number,
                f"must have {len(names)} cells like the header, not {len(cells)}",
                kind="cell_count",
            )
        if b"_" in line:  # float() would accept 1_0 as 10
            _refuse_number(cells, names, number, file)
        try:
            values.extend(map(float, cells))
        except ValueError:
            _refuse_number(cells, names, number, file)
    if not values:
        raise RecordingError(file, 1, "must have rows after its header", kind="no_rows")
    return np.frombuffer(values, dtype=np.float64).reshape(-1, len(names))


def _refuse_number(cells: list[bytes], names: list[str], number: int, file: str) -> NoReturn:
    name, cell = next((name, cell) for name, cell in zip(names, cells, strict=True) if not _is_number(cell))
    shown = _visible(cell.strip().decode("ascii", errors="backslashreplace"))
    raise RecordingError(
        file, number, f"{name} must be a number such as 0.25, not '{shown}'", kind="not_a_number"
    )


def _visible(text: str) -> str:
    """Escape control characters for a terminal, and cut the text."""
    return text[:40].encode("unicode_escape").decode("ascii").replace("\\\\", "\\")


def _is_number(cell: bytes) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return b"_" not in cell


def _check_range(values: Array, name: str, allowed: Range, file: str) -> None:
    bad = ~((values >= allowed.low) & (values <= allowed.high))  # NaN is refused as well
    if bad.any():
        row = int(bad.argmax())
        raise RecordingError(
            file, row + 2, f"{name} must be from {allowed}, not {values[row]:g}", kind="out_of_range"
        )


def _check_time(t_s: Array, file: str) -> None:
    stuck = np.diff(t_s) <= 0.0
    if stuck.any():
        row = int(stuck.argmax()) + 1
        raise RecordingError(
            file,
            row + 2,
            f"t_s must increase, but {t_s[row]:g} follows {t_s[row - 1]:g}",
            kind="time_order",
        )


def _in_our_units(groups: dict[str, Array]) -> dict[str, Array]:
    if "mag" in groups:
        groups["mag"] *= MGAUSS_PER_UT
    return {name: values if values.shape[1] > 1 else values[:, 0] for name, values in groups.items()}
