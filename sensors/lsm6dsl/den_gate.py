"""The gate of data enable by edge: of a sensor's samples, the first after each edge (AN5040 Rev 3, 4.8)."""

from __future__ import annotations

from sensors.sampling import SampleStream, Times


class Gate:
    """``source``: the sensor's stream, which goes on; ``shown``: what comes through while ``closed``."""

    def __init__(self, source: SampleStream) -> None:
        self.source = source
        self.shown = SampleStream(6, self._produce)
        self.closed = False
        self._index = 0  # of the sample let through
        self._pending = False

    def close(self, closed: bool, now_ps: int) -> None:
        """From ``now_ps`` on only what is let through is shown, or everything again."""
        self.catch_up(now_ps)
        if closed:
            self.shown.data = self.source.data
            self.shown.stop()
        else:
            self.source.data = self.shown.data  # until the next sample
        self.closed, self._pending = closed, False

    def open(self, at_ps: int) -> None:
        """An edge: the next sample passes."""
        if self.closed:
            self._pending = True
            self.aim(at_ps)

    def aim(self, now_ps: int) -> None:
        """Let the first sample after ``now_ps`` pass if one may; its rate may have changed."""
        if self._pending and self.source.running:
            self._index = self.source.latest(now_ps) + 1
            self.shown.start_single(now_ps, self.source.time_ps(self._index) - now_ps)

    def catch_up(self, now_ps: int) -> None:
        """The sensor goes on measuring behind the gate; a sample that is due has passed."""
        if not self.closed:
            return
        if self._pending and self.source.running and self.source.time_ps(self._index) <= now_ps:
            self._pending = False
        if now_ps >= self.source.next_ps:
            self.source.advance(now_ps)

    def _produce(self, number: int, t_s: Times) -> bytes:
        del number, t_s
        return self.source.samples(self._index, self._index + 1).tobytes()


class Gates:
    """What data enable lets through: samples of a sensor, and anything to the FIFO."""

    def __init__(self) -> None:
        self.fifo_open = True
        self._instead: dict[SampleStream, SampleStream] = {}

    def show(self, stream: SampleStream, instead: SampleStream | None) -> None:
        """``stream`` is shown through another one from now on, or as it is."""
        self._instead.pop(stream, None)
        if instead is not None:
            self._instead[stream] = instead

    def shown(self, stream: SampleStream) -> SampleStream:
        """What output registers, data-ready and FIFO see of a sensor's stream."""
        return self._instead.get(stream, stream)
