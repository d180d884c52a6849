"""Plots as inline SVG: printed numbers with the truth, and a class's distribution."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from fcu_emulator.emulator.grading.reports.markup import Html, element
from fcu_emulator.emulator.grading.verdict import Series

_WIDTH, _HEIGHT = 440.0, 180.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 58.0, 12.0, 26.0, 30.0
_ROOM = 1.5  # a print is off the chart if it is more than 1.5 ranges away from the truth
_WRAP = 180.0  # degrees; a larger change of a direction is a wrap-around


class _Frame:
    def __init__(self, x: tuple[float, float], y: tuple[float, float]) -> None:
        self._x0, self._x1 = x
        self.low, self.high = y

    def x(self, value: float) -> float:
        return _LEFT + (value - self._x0) / (self._x1 - self._x0) * (_WIDTH - _LEFT - _RIGHT)

    def y(self, value: float) -> float:
        inner = _HEIGHT - _TOP - _BOTTOM
        return _HEIGHT - _BOTTOM - (value - self.low) / (self.high - self.low) * inner

    def has(self, value: float) -> bool:
        return self.low <= value <= self.high

    def axes(self, unit: str, along: str = "s") -> Iterator[Html]:
        right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM
        for value in _steps(self.low, self.high, 5):
            place = self.y(value)
            yield element("line", x1=_LEFT, x2=right, y1=place, y2=place, class_="grid")
            yield element("text", _label(value), x=_LEFT - 6, y=place + 4, class_="tick", text_anchor="end")
        for value in _steps(self._x0, self._x1, 8):
            place = self.x(value)
            yield element("line", x1=place, x2=place, y1=bottom, y2=bottom + 4, class_="axis")
            yield element("text", _label(value), x=place, y=bottom + 16, class_="tick", text_anchor="middle")
        yield element("line", x1=_LEFT, x2=right, y1=bottom, y2=bottom, class_="axis")
        yield element("text", unit, x=_LEFT - 6, y=_TOP - 10, class_="tick", text_anchor="end")
        yield element("text", along, x=right, y=_HEIGHT - 4, class_="tick", text_anchor="end")


def series_plot(series: Series) -> Html:
    """Return a chart of printed numbers as dots, with the truth. Numbers off the chart are drawn at its edge."""
    if not series.t_s:
        return element("p", f"{series.name} was never printed.", class_="quiet")
    frame = _frame(series)
    printed = [(t, value) for t, value in zip(series.t_s, series.printed, strict=True)]
    off = sum(value is not None and not frame.has(value) for _, value in printed)
    without = sum(value is None for _, value in printed)
    drawn = [
        *frame.axes(series.unit),
        *_truth(series, frame),
        *(_mark(frame, t, value) for t, value in printed),
        *_legend(off, without),
    ]
    what = f"{series.name}: printed values and true values"
    return element(
        "figure",
        element("figcaption", what),
        _svg(drawn, what),
    )


def _frame(series: Series) -> _Frame:
    low, high = min(series.truth), max(series.truth)
    span = max(high - low, 0.05 * max(abs(low), abs(high)), 1e-3)
    near = [
        value
        for value in series.printed
        if value is not None and low - _ROOM * span <= value <= high + _ROOM * span
    ]
    low, high = min([low, *near]), max([high, *near])
    margin = 0.08 * max(high - low, span)
    ends = min(series.t_s), max(series.t_s)
    begin = 0.0 if ends[0] < 0.3 * ends[1] else ends[0]
    return _Frame((begin, max(ends[1], begin + 1e-3)), (low - margin, high + margin))


def _truth(series: Series, frame: _Frame) -> Iterator[Html]:
    piece: list[str] = []
    before: float | None = None
    for t, value in zip(series.t_s, series.truth, strict=True):
        if before is not None and series.unit == "deg" and abs(value - before) > _WRAP:
            yield _line(piece)
            piece = []
        piece.append(f"{frame.x(t):.1f},{frame.y(value):.1f}")
        before = value
    yield _line(piece)


def _line(points: Sequence[str]) -> Html:
    return element("polyline", points=" ".join(points), class_="truth")


def _mark(frame: _Frame, t: float, value: float | None) -> Html:
    x = frame.x(t)
    if value is None:
        y = _HEIGHT - _BOTTOM - 6
        return element("path", d=f"M{x - 3:.1f} {y - 3:.1f}l6 6m0 -6l-6 6", class_="none")
    if frame.has(value):
        return element("circle", cx=x, cy=frame.y(value), r=2.6, class_="printed")
    y, way = (_TOP + 1, 7) if value > frame.high else (_HEIGHT - _BOTTOM - 1, -7)
    return element("path", d=f"M{x:.1f} {y:.1f}l4 {way}h-8z", class_="beyond")


def _legend(off: int, without: int) -> Iterator[Html]:
    x, y = _LEFT + 4, _TOP - 14
    yield element("line", x1=x, x2=x + 18, y1=y, y2=y, class_="truth")
    yield element("text", "truth", x=x + 23, y=y + 4, class_="tick")
    yield element("circle", cx=x + 72, cy=y, r=2.6, class_="printed")
    yield element("text", "printed", x=x + 80, y=y + 4, class_="tick")
    notes = [f"{off} outside of the plot"] if off else []
    notes += [f"{without} not a number"] if without else []
    yield element("text", ", ".join(notes), x=x + 140, y=y + 4, class_="tick warn")


def histogram(values: Sequence[float], most: float) -> Html:
    """Return a histogram of points from 0 to ``most``. Columns exclude their upper limit."""
    step = max(1, math.ceil(most / 25))
    edges = [*(step * index for index in range(math.ceil(most / step))), most, most + step]
    counts = [sum(low <= value < high for value in values) for low, high in pairwise(edges[:-1])]
    counts.append(sum(value >= most for value in values))
    frame = _Frame((0.0, most + step), (0.0, max(4.0, max(counts) * 1.05)))
    bars = [
        element(
            "rect",
            element("title", f"{count} with {low:g} points" + (f" to {high:g}" if low < most else ", all")),
            x=frame.x(low) + 1,
            y=frame.y(count),
            width=max(frame.x(high) - frame.x(low) - 2, 1),
            height=frame.y(0) - frame.y(count),
            class_="bar",
        )
        for count, (low, high) in zip(counts, pairwise(edges), strict=True)
        if count
    ]
    return _svg([*frame.axes("students", "points"), *bars], "number of students by points")


def share_bar(share: float) -> Html:
    """Return a bar filled from the left."""
    return element(
        "svg",
        element("rect", x=0, y=0, width=100, height=8, rx=2, class_="bar-ground"),
        element("rect", x=0, y=0, width=100 * min(max(share, 0.0), 1.0), height=8, rx=2, class_="bar"),
        viewBox="0 0 100 8",
        class_="share",
        role="img",
        aria_label=f"{share:.0%}",
    )


def _svg(drawn: Iterable[Html], what: str) -> Html:
    box = f"0 0 {_WIDTH:g} {_HEIGHT:g}"
    return element("svg", *drawn, viewBox=box, class_="plot", role="img", aria_label=what)


def _steps(low: float, high: float, about: int) -> list[float]:
    raw = (high - low) / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= raw)
    first = math.ceil(low / step)
    return [
        index * step for index in range(first, first + 2 * about + 2) if index * step <= high + 1e-9 * step
    ]


def _label(value: float) -> str:
    return f"{value:.6g}" if value else "0"
