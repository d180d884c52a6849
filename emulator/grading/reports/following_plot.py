"""Plots of a LED or line beside its condition, as inline SVG."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fcu_emulator.emulator.grading.reports.markup import Html, element
from fcu_emulator.emulator.grading.verdict import Following

_WIDTH, _LEFT, _RIGHT = 440.0, 58.0, 12.0
_ROW, _BAR = 20.0, 12.0
_THINNEST = 1.5  # a printed line has no duration


def following_plot(following: Following, duration_s: float) -> Html:
    """Return a figure with two rows over time: the expected state, and the observed state."""
    what = f"{following.name} while {following.condition}"
    rows = (("wanted", following.wanted, "bar-ground"), ("seen", following.shown, "bar"))
    height = _ROW * (len(rows) + 1)
    drawn = [part for number, row in enumerate(rows) for part in _row(*row, _ROW * number, duration_s)]
    drawn += _axis(_ROW * len(rows), duration_s)
    box = f"0 0 {_WIDTH:g} {height:g}"
    svg = element("svg", *drawn, viewBox=box, class_="plot", role="img", aria_label=what)
    return element("figure", element("figcaption", what), svg)


def _row(
    name: str, spans: Sequence[tuple[float, float]], style: str, top: float, duration_s: float
) -> Iterator[Html]:
    yield element("text", name, x=_LEFT - 6, y=top + _BAR - 2, class_="tick", text_anchor="end")
    for begin_s, end_s in spans:
        left = _place(begin_s, duration_s)
        width = max(_place(end_s, duration_s) - left, _THINNEST)
        yield element("rect", x=left, y=top, width=width, height=_BAR, class_=style)


def _axis(top: float, duration_s: float) -> Iterator[Html]:
    yield element("line", x1=_LEFT, x2=_WIDTH - _RIGHT, y1=top, y2=top, class_="axis")
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        place, text = _place(share * duration_s, duration_s), f"{share * duration_s:.3g}"
        yield element("text", text, x=place, y=top + _BAR + 2, class_="tick", text_anchor="middle")


def _place(at_s: float, duration_s: float) -> float:
    share = min(at_s / duration_s, 1.0) if duration_s else 0.0
    return _LEFT + share * (_WIDTH - _LEFT - _RIGHT)
