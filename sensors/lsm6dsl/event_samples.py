"""What the event functions look at: samples before LPF2, and behind it for LOW_PASS_ON_6D (AN5040 3.7).

They are the output's own samples with other filters: analog chain and LPF1 only, no composite filter, no user
offset. They are computed while an event function is on, and only then.

Decisions where the documents are silent: switched on while the accelerometer runs, these filters begin
settled on the next sample; the road not taken, running them all along, would make every measurement pay.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from sensors.filtering import SampledFilter, Source
from sensors.filters import Array, Chain, Section, chain

Sections: TypeAlias = tuple[Section, ...]

_UNCHANGED: Section = (1.0, 0.0, 0.0, 0.0, 0.0)


class EventFilters(NamedTuple):
    """The filters of both views; None while the accelerometer is off, () where nothing is filtered."""

    before_lpf2: Sections | None
    behind_lpf2: Sections | None


class EventSamples:
    """Both views of the accelerometer's samples, by the numbers of its stream; blocks are (3, n), in mg."""

    def __init__(self, unfiltered: Source) -> None:
        self._filters = EventFilters(None, None)
        self._before, self._behind = SampledFilter(unfiltered), SampledFilter(unfiltered)
        self._watched = self._low_passed = False

    # -- for the accelerometer --------------------------------------------------------------------------

    def settings_change(self, filters: EventFilters, number: int, *, restarts: bool) -> None:
        """From sample ``number`` on the source has other settings; not yet while this is called."""
        anew = restarts or filters != self._filters
        self._filters = filters
        if self._watched:
            _follow(self._before, filters.before_lpf2, number, anew=anew)
        if self._low_passed:
            _follow(self._behind, filters.behind_lpf2, number, anew=anew)

    def world_changed(self, number: int) -> None:
        """The signals are others from sample ``number`` on."""
        if self._watched:
            self._before.forget(number)
        if self._low_passed:
            self._behind.forget(number)

    # -- for the event functions ------------------------------------------------------------------------

    def watch(self, number: int, *, on: bool, low_pass: bool) -> None:
        """From sample ``number`` on the view before LPF2 is needed, and the one behind it, or not."""
        if on != self._watched:
            self._watched = on
            self._before.restart(_chain(self._filters.before_lpf2) if on else None, number)
        low_pass = on and low_pass
        if low_pass != self._low_passed:
            self._low_passed = low_pass
            self._behind.restart(_chain(self._filters.behind_lpf2) if low_pass else None, number)

    def before_lpf2(self, number: int, count: int) -> Array:
        """Samples ``number`` and following."""
        return self._before.block(number, count)

    def behind_lpf2(self, number: int, count: int) -> Array:
        """Likewise through LPF2, whatever the output shows."""
        return self._behind.block(number, count)


def _follow(view: SampledFilter, sections: Sections | None, number: int, *, anew: bool) -> None:
    if anew:
        view.restart(_chain(sections), number)
    else:
        view.split(number)


def _chain(sections: Sections | None) -> Chain | None:
    if sections is None:
        return None
    return chain(sections, "settled") if sections else chain((_UNCHANGED,), "zero")
