"""The FIFO agrees with an oracle that does everything immediately and keeps every word in a list (AN5040 8)."""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.fifo_fakes import FLAGS, RATES_HZ, TEMPERATURE, XL, Bench, G, sample_ps, sample_word
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, PS_PER_US

BYPASS, FIFO, CONTINUOUS_TO_FIFO, BYPASS_TO_CONTINUOUS, CONTINUOUS = 0, 1, 3, 4, 6
DECIMATION = (0, 1, 2, 3, 4, 8, 16, 32)
SET, TICK_PS = 3, 25 * PS_PER_US


class Sensor:
    """A sensor's rate, its start, and its samples with their times."""

    def __init__(self, mark: int, axes: int = 3) -> None:
        self.mark, self.axes = mark, axes
        self.rate_hz, self.start_ps, self.count = 0.0, 0, 0
        self.words = [0] * axes

    def set_rate(self, rate_hz: float, now_ps: int) -> None:
        if rate_hz != self.rate_hz:
            self.rate_hz, self.start_ps, self.count = rate_hz, now_ps, 0

    def next_ps(self) -> int:
        return sample_ps(self.start_ps, self.rate_hz, self.count + 1) if self.rate_hz else 1 << 62

    def samples_at(self, t_ps: int) -> bool:
        nearest = 1 + round((t_ps - self.start_ps) * self.rate_hz / PS_PER_S) if self.rate_hz else 0
        numbers = range(max(1, nearest - 2), nearest + 1)
        return any(t_ps == sample_ps(self.start_ps, self.rate_hz, number) for number in numbers)

    def take(self) -> None:
        t_s = self.next_ps() / PS_PER_S
        self.words = [sample_word(self.mark, t_s, axis) for axis in range(self.axes)]
        self.count += 1


class Oracle:
    """An oracle that handles samples and words one after the other."""

    def __init__(self) -> None:
        self.now_ps = 0
        self.xl, self.g, self.temperature = Sensor(XL), Sensor(G), Sensor(TEMPERATURE, 1)
        self.timer_start_ps = 0
        self.heard: list[tuple[str, bool, int]] = []
        self.shown = dict.fromkeys(FLAGS, False)
        self.mode, self.fourth, self.only_high = BYPASS, "hub", False
        self.decimations: tuple[int, ...] = (0, 0, 0, 0)
        self.every, self.depth, self.watermark = 0, 2048, 0
        self.triggers: set[str] = set()
        self.clear()

    def clear(self) -> None:
        self.stored: list[tuple[int, int]] = []  # word, place in the pattern
        self.samples = self.count = 0  # of the leader since the FIFO is on; triggers
        self.switched = self.stopped = self.overrun = False
        self.place = 0

    # -- time -------------------------------------------------------------------------------------------

    def leader(self) -> Sensor:
        return self.g if self.g.rate_hz >= self.xl.rate_hz else self.xl

    def run_until_ps(self, t_ps: int) -> None:
        sensors = (self.temperature, self.xl, self.g)
        while min(sensor.next_ps() for sensor in sensors) <= t_ps:
            self.now_ps = min(sensor.next_ps() for sensor in sensors)
            due = [sensor for sensor in sensors if sensor.next_ps() == self.now_ps]
            for sensor in due:
                sensor.take()
            if self.leader() in due:
                self.sample_of_the_leader()
        self.now_ps = t_ps

    def sample_of_the_leader(self) -> None:
        waits = self.mode == BYPASS_TO_CONTINUOUS and not self.switched
        if self.mode == BYPASS or waits or not self.every:
            return
        if self.samples % self.every == 0 and not self.stopped:
            self.write_sets()
        self.samples += 1

    def event(self, name: str) -> None:
        if name in self.triggers and self.mode != BYPASS:
            self.switched = True
            self.check()

    # -- words ------------------------------------------------------------------------------------------

    def sets_at(self, trigger: int) -> list[int]:
        return [number for number, every in enumerate(self.decimations) if every and trigger % every == 0]

    def pattern_length(self) -> int:
        period = lcm(*(every for every in self.decimations if every))
        return sum(SET * len(self.sets_at(trigger)) for trigger in range(period))

    def words_of(self, number: int) -> list[int]:
        if number == 0 and self.only_high:
            pairs = zip(self.xl.words, self.g.words, strict=True)
            return [xl >> 8 | g & 0xFF00 for xl, g in pairs]
        if number < 2:
            return (self.g, self.xl)[number].words
        if number == 2 or self.fourth == "hub":
            return [0, 0, 0]
        if self.fourth == "temperature":
            return [0, self.temperature.words[0], 0]
        ticks = (self.now_ps - self.timer_start_ps) // TICK_PS
        return [ticks >> 8 & 0xFFFF, (ticks & 0xFF) << 8, 0]

    def write_sets(self) -> None:
        length = self.pattern_length()
        for number in self.sets_at(self.count):
            for word in self.words_of(number):
                self.stored.append((word, self.place % length))
                self.place += 1
        self.count += 1
        while len(self.stored) > self.depth:
            self.stored.pop(0)
            self.overrun = True
        self.check()

    def pop(self) -> int:
        self.overrun = False
        word = self.stored.pop(0)[0]
        self.check()
        return word

    def flags(self) -> dict[str, bool]:
        fill, ahead = len(self.stored), SET * len(self.sets_at(self.count))
        waits = self.mode == BYPASS_TO_CONTINUOUS and not self.switched
        return {
            "FTH": 0 < self.watermark <= fill,
            "FULL_FLAG": self.mode != BYPASS and not waits and fill + ahead >= self.depth,
            "FIFO_OVR": self.overrun,
        }

    def check(self) -> None:
        flags = self.flags()
        stops = self.mode == FIFO or (self.mode == CONTINUOUS_TO_FIFO and self.switched)
        self.stopped = self.stopped or (stops and flags["FULL_FLAG"])
        for name in FLAGS:
            if flags[name] != self.shown[name]:
                self.shown[name] = flags[name]
                self.heard.append((name, flags[name], self.now_ps))

    def status(self) -> bytes:
        flags, fill = self.flags(), len(self.stored)
        bits = 0x80 * flags["FTH"] | 0x40 * flags["FIFO_OVR"] | 0x20 * flags["FULL_FLAG"] | 0x10 * (not fill)
        length = self.pattern_length()
        place = self.stored[0][1] if self.stored else self.place % length if length else 0
        return bytes((fill & 0xFF, bits | fill >> 8 & 0x07, place & 0xFF, place >> 8))


@dataclass(frozen=True)
class Setup:
    """A configuration that is reached through bypass; ``xl``, ``g``, ``rate``: ODR codes."""

    xl: int
    g: int
    rate: int
    mode: int
    decimations: tuple[int, int, int, int]  # codes
    fourth: str
    watermark: int
    stops: bool
    only_high: bool


SETUPS = st.builds(
    Setup,
    xl=st.integers(1, 6),
    g=st.integers(0, 6),
    rate=st.integers(3, 10),
    mode=st.sampled_from((FIFO, CONTINUOUS_TO_FIFO, BYPASS_TO_CONTINUOUS, CONTINUOUS)),
    decimations=st.tuples(*[st.sampled_from((1, 0, 1, 2, 3, 4, 5, 6, 7))] * 4),
    fourth=st.sampled_from(("timestamp", "temperature", "hub")),
    watermark=st.integers(10, 90) | st.integers(0, 2047),
    stops=st.booleans(),
    only_high=st.booleans(),
)
WAITS = st.tuples(st.just("wait"), st.integers(0, 300 * PS_PER_MS) | st.integers(PS_PER_S, 6 * PS_PER_S))
STEPS = st.one_of(
    WAITS,
    WAITS,
    st.tuples(st.just("read"), st.integers(1, 30) | st.integers(0, 2048)),
    st.tuples(st.just("event"), st.sampled_from((1, 1, 0))),
    st.tuples(st.just("ahead"), st.integers(1, 100 * PS_PER_MS)),
    st.tuples(st.just("look"), st.just(0)),
    st.tuples(st.just("early"), st.just(0)),
)


class Traffic:
    """The same accesses to the FIFO and to the oracle."""

    def __init__(self) -> None:
        self.bench, self.oracle = Bench(), Oracle()
        self.bench.write(0x5C, 0x10)  # TIMER_HR
        self.bench.write(0x0D, 0x38)  # INT1_FULL_FLAG, INT1_FIFO_OVR, INT1_FTH
        self.bench.write(0x5F, 0x20)  # INT2_WU
        self.bench.write(0x10, 0x10)  # the timer runs once a sensor does, and one always does
        self.bench.write(0x19, 0x20)  # TIMER_EN
        self.oracle.triggers = {"WU"}
        self._follow(1, 0)

    def _follow(self, xl: int, g: int) -> None:
        self.oracle.xl.set_rate(RATES_HZ[xl], self.bench.t_ps)
        self.oracle.g.set_rate(RATES_HZ[g], self.bench.t_ps)
        self.oracle.temperature.set_rate(52, self.bench.t_ps)

    def set_up(self, setup: Setup) -> None:
        bench, oracle = self.bench, self.oracle
        bench.write(0x0A, 0x00)
        oracle.mode, oracle.depth = BYPASS, 2048
        oracle.clear()
        oracle.check()
        bench.write(0x10, setup.xl << 4, setup.g << 4)
        self._follow(setup.xl, setup.g)
        first, second, third, fourth = setup.decimations
        kinds = {"hub": 0x00, "timestamp": 0x80, "temperature": 0x08}
        bench.write(0x06, setup.watermark & 0xFF, setup.watermark >> 8 | kinds[setup.fourth])
        ctrl4 = 0x80 * setup.stops | 0x40 * setup.only_high | fourth << 3 | third
        bench.write(0x08, first << 3 | second, ctrl4)
        oracle.only_high = setup.only_high
        bench.write(0x0A, setup.rate << 3 | setup.mode)
        oracle.mode, oracle.fourth, oracle.watermark = setup.mode, setup.fourth, setup.watermark
        oracle.decimations = tuple(DECIMATION[code] for code in setup.decimations)
        oracle.depth = setup.watermark if setup.stops and setup.watermark else 2048
        oracle.every = 2 ** max(0, max(setup.xl, setup.g) - setup.rate)
        oracle.check()

    def wait(self, ps: int) -> None:
        self.bench.wait(ps)
        self.oracle.run_until_ps(self.bench.t_ps)

    def read(self, count: int) -> None:
        available = min(count, len(self.oracle.stored))
        assert self.bench.words(available) == [self.oracle.pop() for _ in range(available)]

    def _between_samples(self, at_ps: int) -> int:
        """Return the first time from ``at_ps`` without a sample; another test has the order of samples and events."""
        while any(sensor.samples_at(at_ps) for sensor in (self.oracle.xl, self.oracle.g)):
            at_ps += 1
        return at_ps

    def event(self, routed: int) -> None:
        self.wait(self._between_samples(self.bench.t_ps + 1) - self.bench.t_ps)
        self.bench.pulse("WU" if routed else "FF")
        self.oracle.event("WU" if routed else "FF")

    def ahead(self, ps: int) -> None:
        """Let a function that works ahead raise its event early; the event must not be visible before its time."""
        bench, oracle = self.bench, self.oracle
        at_ps = self._between_samples(bench.t_ps + ps)
        bench.catch_up(bench.t_ps)
        bench.signals.set("WU", True, at_ps)
        bench.signals.set("WU", False, at_ps)
        for moment_ps in (at_ps - (ps + 1) // 2, at_ps - 1):  # both before the event, even with ps = 1
            if moment_ps > bench.t_ps:
                self.wait(moment_ps - bench.t_ps)
                self.look(0)
        self.wait(at_ps - bench.t_ps)
        oracle.event("WU")

    def look(self, _: int) -> None:
        assert self.bench.read(0x3A, 4) == self.oracle.status()

    def early(self, _: int) -> None:
        """Check that no flag changes before the time that the FIFO has announced."""
        bench = self.bench
        bench.catch_up(bench.t_ps)
        heard, next_ps = len(bench.heard), bench.fifo.next_event_ps()
        assert next_ps > bench.t_ps
        self.wait(min(next_ps, bench.t_ps + 3 * PS_PER_S) - 1 - bench.t_ps)
        bench.catch_up(bench.t_ps)
        assert len(bench.heard) == heard


@settings(max_examples=40)
@given(runs=st.lists(st.tuples(SETUPS, st.lists(STEPS, min_size=4, max_size=15)), min_size=1, max_size=3))
def test_any_traffic_equals_oracle(runs: list[tuple[Setup, list[tuple[str, int]]]]) -> None:
    traffic = Traffic()
    for setup, steps in runs:
        traffic.set_up(setup)
        for name, argument in steps:
            getattr(traffic, name)(argument)
        traffic.look(0)
    assert traffic.bench.heard == traffic.oracle.heard
    assert "FIFO configuration changed without going through bypass" not in traffic.bench.notes
