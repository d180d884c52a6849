"""The speed table: ``python -m tests.bench``.

::

    --quick          without the hour of virtual time
    --only PATTERN   rows whose name matches this regular expression
    --json FILE      also write the figures as JSON
    --append         also add the figures to the history, which python -m tests.bench.history shows

Each row first asserts its results (text, tick count), then shows the best of several measurements in CPU
time. Ratios to real time depend on the machine. Compare two builds on the same machine and at the same time.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path

from tests.bench import arm, build, history, lab3, start
from tests.bench.row import Row


def say(line: str) -> None:
    """Print a line of the table immediately."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def table(rows: list[Row]) -> list[dict[str, object]]:
    """Measure and print the rows; return the figures."""
    say(f"{'what':<52} {'measured':>12}   wanted")
    figures: list[dict[str, object]] = []
    for row in rows:
        value = row.measure()
        say(f"{row.name:<52} {f'{value:.{row.digits}f} {row.unit}'.rstrip():>12}   {row.wanted}".rstrip())
        figures.append(
            {
                "name": row.name,
                "value": value,
                "unit": row.unit,
                "at_least": row.at_least,
                "aim": row.aim,
                "less_is_better": row.less_is_better,
            }
        )
    return figures


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench")
    parser.add_argument("--quick", action="store_true", help="without the hour of virtual time")
    parser.add_argument("--only", default="", metavar="PATTERN", help="rows whose name matches")
    parser.add_argument("--json", type=Path, metavar="FILE", help="the figures as JSON, too")
    parser.add_argument("--append", action="store_true", help="the figures to the history, too")
    options = parser.parse_args()
    rows = [*lab3.rows(), *arm.rows(), *start.rows(), *([] if options.quick else lab3.hour_rows())]
    chosen = [row for row in rows if re.search(options.only, row.name)]
    if not chosen:
        parser.error(f"no row matches {options.only}; there are: " + "; ".join(row.name for row in rows))
    described = build.describe()
    for name, value in described.items():
        say(f"{name}: {value}")
    busy = history.load()
    figures = table(chosen)
    if options.append:
        history.append(described, figures, busy)
    if options.json:
        options.json.write_text(json.dumps({"build": described, "rows": figures}, indent=1) + "\n")


if __name__ == "__main__":
    main()
