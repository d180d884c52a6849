"""Reports for people: a printed number against the truth, over the run."""

from __future__ import annotations

from collections.abc import Sequence

from emulator.scenario.printed import ANGLES, FORMAT_OF_FIELD
from emulator.scenario.recorder import Line
from emulator.scenario.truth import G_MODULUS
from emulator.time.clock import PS_PER_S

_MOST_ROWS = 12
_STILL_G = 0.05


def against_truth(field: str, lines: Sequence[Line]) -> list[str]:
    """A table of prints: time, printed, truth at that time, error (printed - truth); then a summary."""
    rows = []
    for line in lines:
        fields = FORMAT_OF_FIELD[field].parse(line.text)
        if fields is not None:
            truth = float(line.truth[field][1][-1])
            error = line.error(field, fields[field], 0)
            rows.append((line.at_ps / PS_PER_S, fields[field], truth, error, _flag(field, line)))
    if not rows:
        return [f"{field} against the truth: never printed"]
    table = [f"{field} against the truth", f"{'t':>9} {'printed':>12} {'truth':>12} {'error':>12}"]
    for index in _chosen(len(rows)):
        t_s, printed, truth, error, flag = rows[index]
        table.append(f"{t_s:>7.3f} s {printed:>12.3f} {truth:>12.3f} {error:>+12.3f}{flag}")
    first, last = rows[0][3], rows[-1][3]
    largest = max((row[3] for row in rows), key=abs)
    table.append(f"error: first {first:+.3f}, last {last:+.3f}, largest {largest:+.3f}, {len(rows)} prints")
    return table


def _flag(field: str, line: Line) -> str:
    """Accelerometer data can only be used for tilt when the modulus is near 1 g (slides, "eCompass math")."""
    if field not in ANGLES:
        return ""
    modulus = float(line.truth[G_MODULUS][1][-1])
    return "" if abs(modulus - 1.0) <= _STILL_G else f"   |G| is {modulus:.2f} g: no tilt sensor now"


def _chosen(count: int) -> list[int]:
    """Indices of at most a dozen rows, evenly spaced, the first and the last among them."""
    if count <= _MOST_ROWS:
        return list(range(count))
    return [index * (count - 1) // (_MOST_ROWS - 1) for index in range(_MOST_ROWS)]
