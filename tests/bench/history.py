"""History of the speed table: ``python -m tests.bench.history``.

::

    --only PATTERN   rows whose name matches this regular expression
    --svg FILE       a curve for each row, by matplotlib (pip install matplotlib)

``python -m tests.bench --append`` adds a line to ``history.jsonl`` beside this file: date, build, machine,
load and figures. Figures of different machines cannot be compared, so each machine has its own line of dots.
A table of a busy machine (a load above the number of cores) is omitted.
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import os
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

FILE = Path(__file__).with_name("history.jsonl")
_DOTS = "▁▂▃▄▅▆▇█"


class Point(NamedTuple):
    """A figure of the table, and the time of its measurement."""

    date: str
    commit: str
    value: float


def load() -> float:
    """Return the number of processes per core that needed a core in the last minute; 0 if the system does not tell."""
    return os.getloadavg()[0] / (os.cpu_count() or 1) if hasattr(os, "getloadavg") else 0.0


def append(build: dict[str, str], figures: list[dict[str, Any]], busy: float, file: Path = FILE) -> None:
    """Append a table. ``busy`` is the load before the measurement."""
    date = dt.datetime.now(dt.UTC).strftime("%Y-%m-%d %H:%M")
    rows = {figure["name"]: [round(figure["value"], 4), figure["unit"]] for figure in figures}
    with file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps({"date": date, **build, "load": round(busy, 2), "rows": rows}) + "\n")


def curves(file: Path = FILE, pattern: str = "") -> dict[tuple[str, str, str], list[Point]]:
    """Return the points by machine, row and unit, in the order of measurement, without those on a busy machine."""
    found: dict[tuple[str, str, str], list[Point]] = defaultdict(list)
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        table = json.loads(line)
        if table["load"] > 1:
            continue
        for name, (value, unit) in table["rows"].items():
            if re.search(pattern, name):
                found[table["machine"], name, unit].append(Point(table["date"], table["commit"], value))
    return found


def dots(values: list[float]) -> str:
    """Return a line of block characters, whose heights are the values from the smallest to the largest."""
    low, high = min(values), max(values)
    return "".join(_DOTS[round((value - low) / ((high - low) or 1) * (len(_DOTS) - 1))] for value in values)


def lines(found: dict[tuple[str, str, str], list[Point]]) -> Iterator[str]:
    """Return the table of all curves: first and last value, and the curve between them."""
    machine = None
    for (where, name, unit), points in sorted(found.items()):
        if where != machine:
            machine = where
            yield f"{machine}, {points[0].date[:10]} to {points[-1].date[:10]}"
        values = [point.value for point in points]
        yield f"  {name:<46} {values[0]:>9.4g} -> {values[-1]:>8.4g} {unit:<5} {dots(values)}".rstrip()


def plot(found: dict[tuple[str, str, str], list[Point]], file: Path) -> None:
    """Draw a picture with a small diagram for each row."""
    import matplotlib as mpl

    mpl.use("svg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(
        len(found), figsize=(8, 1.6 * len(found)), squeeze=False, layout="constrained"
    )
    for axis, ((_, name, unit), points) in zip(axes[:, 0], sorted(found.items()), strict=True):
        axis.plot([point.commit for point in points], [point.value for point in points], "o-")
        axis.set_title(f"{name} [{unit}]" if unit else name, loc="left", fontsize=9)
        axis.set_ylim(bottom=0)
    figure.savefig(file)


def main() -> None:
    """Print the curves."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.history")
    parser.add_argument("--only", default="", metavar="PATTERN", help="rows whose name matches")
    parser.add_argument("--svg", type=Path, metavar="FILE", help="a picture of the curves")
    options = parser.parse_args()
    found = curves(pattern=options.only)
    if not found:
        parser.error("nothing was measured on a quiet machine yet: python -m tests.bench --append")
    sys.stdout.write("".join(f"{line}\n" for line in lines(found)))
    if options.svg:
        plot(found, options.svg)


if __name__ == "__main__":
    main()
