"""Sensor pins in time: wakes a part on the board's clock when one of its wired pins may change.

Parts work when somebody looks at them. A pin somebody listens to is such a look: from the first listener on,
the part is caught up at every time at which a pin of it may change, and asked again after every access by the
bus. A pin that hangs in the air costs nothing.
"""

from __future__ import annotations

from functools import partial

from emulator.time.clock import NEVER_PS, Clock, Event
from emulator.trace import GpioEdge, Trace
from sensors.part import Part
from sensors.pin import Pin


class PinWatch:
    """Delivers the edges of one part's pins when they happen, and records them in the trace."""

    def __init__(self, part: Part, clock: Clock, trace: Trace) -> None:
        self._part = part
        self._clock = clock
        self._trace = trace
        self._event: Event | None = None
        self._at_ps: int = NEVER_PS
        for pin in part.pins():
            pin.on_wire = partial(self._wire, pin)

    def _wire(self, pin: Pin) -> None:
        self._part.catch_up(self._clock.now_ps)  # edges of the past are not news
        pin.listen(partial(self._record, f"{self._part.NAME}.{pin.name}"))
        self._part.watch(self._arm)
        self._arm()

    def _record(self, name: str, at_ps: int, level: int) -> None:
        self._trace.add(GpioEdge(at_ps, name, level))

    def _arm(self) -> None:
        at_ps = self._part.next_event_ps()
        if at_ps == self._at_ps:
            return
        if self._event is not None:
            self._event.cancel()
            self._event = None
        self._at_ps = at_ps
        if at_ps < NEVER_PS:
            self._event = self._clock.schedule(at_ps, self._due)

    def _due(self) -> None:
        self._event, self._at_ps = None, NEVER_PS
        now_ps = self._clock.now_ps
        self._part.catch_up(now_ps)
        assert self._part.next_event_ps() > now_ps, f"{self._part.NAME} has not caught up"
        self._arm()
