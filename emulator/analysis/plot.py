"""Plot of a run: printed values as points, the preceding truth as bars, and LEDs."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fcu_emulator.emulator.errors import InputError, LinkError

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
KINDS = (".png", ".svg", ".pdf")
_AXES = {  # the key is a line's label up to the first bracket or colon
    "ACC": "acceleration, mg",
    "GYR": "rate, mdps",
    "MAG": "field, mG",
    "Pre": "pressure, hPa",
    "Pitch": "angles, deg",
    "Altitude": "altitude, m",
}


def draw(record: Mapping[str, Any], picture: Path) -> None:
    """Draw ``record``, the JSON of ``fcu run --json``, into ``picture``.

    The suffix selects the format. Raises InputError for unusable records or missing matplotlib,
    LinkError if the file cannot be written.
    """
    if picture.suffix.lower() not in KINDS:
        raise InputError(f"{picture}: the name must end in {', '.join(KINDS)}", kind="picture_type")
    try:
        import matplotlib as mpl
    except ImportError as error:
        raise InputError(
            "fcu plot needs matplotlib; install it: pip install 'fcu-emulator[views]'"
        ) from error
    try:
        panels = _panels(record["printed"])
        lights = [(float(at), [bool(one) for one in on]) for at, *on in record.get("leds", [])]
        end_s = float(record.get("virtual_s", 0.0))
        if not math.isfinite(end_s):
            raise ValueError("the end of the run must be a finite time")
    except (TypeError, ValueError, KeyError, AttributeError, OverflowError) as error:
        problem = "the record is damaged; write it again: fcu run --json FILE"
        raise InputError(problem, kind="damaged") from error
    if not panels:
        problem = "cannot draw this run: its lines contain no known numbers"
        raise InputError(problem, kind="nothing_to_draw")
    settings: Any = {
        "svg.hashsalt": "fcu",
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
    }
    with mpl.rc_context(settings):
        figure = _figure(panels, lights, end_s, _title(record))
        try:
            metadata = {"Date": None} if picture.suffix.lower() == ".svg" else None
            figure.savefig(picture, dpi=120, metadata=metadata)
        except OSError as error:
            raise LinkError(f"{picture}: {error.strerror or error}; give a writable path") from error


class _Field:
    """A printed number's times, values, and true range."""

    def __init__(self) -> None:
        self.at_s: list[float] = []
        self.printed: list[float] = []
        self.low: list[float] = []
        self.high: list[float] = []


def _panels(lines: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, _Field]]:
    panels: dict[str, dict[str, _Field]] = {}
    for line in lines:
        values = line["values"]
        if values is None:
            continue
        fields = panels.setdefault(str(line["label"]), {})
        for name, value in values.items():
            field = fields.setdefault(str(name), _Field())
            low, high = line["truth"].get(name, (math.nan, math.nan))
            field.at_s.append(float(line["at_s"]))
            field.printed.append(float(value))
            field.low.append(float(low))
            field.high.append(float(high))
    return panels


def _title(record: Mapping[str, Any]) -> str:
    board = record.get("board") or {}
    scenario = Path(str(board["scenario"])).stem if board.get("scenario") else ""
    parts = [
        Path(str(board.get("firmware", ""))).name,
        scenario,
        f"seed {board.get('seed', 0)}",
        str(record.get("verdict", "")),
    ]
    return "   ·   ".join(part for part in parts if part)


def _figure(
    panels: Mapping[str, Mapping[str, _Field]],
    lights: Sequence[tuple[float, Sequence[bool]]],
    end_s: float,
    title: str,
) -> Any:
    from matplotlib.figure import Figure

    heights = [2.0] * len(panels) + [0.6] * bool(lights)
    figure = Figure(figsize=(10, 0.9 + sum(heights)), layout="constrained")
    figure.suptitle(title, fontsize=10, x=0.01, horizontalalignment="left")
    figure.legend(handles=_signs(), loc="outside upper right", ncols=2, frameon=False)
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for (label, fields), panel in zip(panels.items(), axes, strict=False):
        _draw_panel(panel, label, fields)
    if lights:
        _draw_lights(axes[-1], lights, end_s)
    axes[-1].set_xlabel("virtual time, s")
    if end_s > 0:
        axes[-1].set_xlim(0, end_s)
    return figure


_PRINTED: Any = {"marker": "o", "markersize": 3.5, "linestyle": "none"}
_TRUTH: Any = {"alpha": 0.35, "linewidth": 1.5}
_BAR: Any = {"alpha": 0.35, "linewidth": 6}


def _signs() -> list[Any]:
    from matplotlib.lines import Line2D

    bar = {"marker": "|", "markersize": 10, "markeredgewidth": _BAR["linewidth"]}
    return [
        Line2D([], [], color="black", **_PRINTED, label="printed"),
        Line2D([], [], color="black", **_TRUTH, **bar, label="true value (bar: its range before the print)"),
    ]


def _draw_panel(panel: Any, label: str, fields: Mapping[str, _Field]) -> None:
    from matplotlib.patches import Patch

    colours = dict(zip(fields, COLOURS * 4, strict=False))
    for name, field in fields.items():
        middle = [(low + high) / 2 for low, high in zip(field.low, field.high, strict=True)]
        panel.plot(field.at_s, middle, color=colours[name], **_TRUTH)
        panel.vlines(field.at_s, field.low, field.high, color=colours[name], **_BAR)
        panel.plot(field.at_s, field.printed, color=colours[name], **_PRINTED)
    panel.set_ylabel(_AXES.get(re.split(r"[\[:]", label)[0], label))
    panel.ticklabel_format(axis="y", useOffset=False)
    panel.grid(visible=True, alpha=0.25)
    names = [Patch(color=colour, label=name) for name, colour in colours.items()]
    panel.legend(handles=names, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)


def _draw_lights(panel: Any, lights: Sequence[tuple[float, Sequence[bool]]], end_s: float) -> None:
    count = len(lights[0][1])
    for number in range(count):
        until = [at for at, _ in lights[1:]] + [end_s]
        lit = [(at, end - at) for (at, on), end in zip(lights, until, strict=True) if on[number]]
        panel.broken_barh(lit, (count - 1 - number + 0.15, 0.7), color="#E69F00")
    panel.set_ylim(0, count)
    panel.set_yticks([count - 0.5 - number for number in range(count)], [f"LED{n + 1}" for n in range(count)])
