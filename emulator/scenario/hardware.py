"""Expectations about LEDs, timer ticks, hard-iron calibration and sensor reads."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import groupby, pairwise
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S, TickCounts, seconds
from fcu_emulator.emulator.scenario.conditions import Condition, Followed, LedName, led_states, unit_text
from fcu_emulator.emulator.scenario.expectations import Expectation, RunView, Windowed
from fcu_emulator.emulator.scenario.fields import Duration, Length
from fcu_emulator.emulator.scenario.result import ExpectationResult
from fcu_emulator.emulator.scenario.run_view import SAMPLE_STEP_PS, BoardView
from fcu_emulator.emulator.trace import BusTransfer, TraceEvent
from fcu_emulator.sensors import SENSORS

# -- LEDs ---------------------------------------------------------------------------------------------------


class ExpectLed(Windowed):
    """A LED is on during the whole window, or off during the whole window."""

    ON_TERMINAL = False

    kind: Literal["led"]
    led: LedName
    state: Literal["on", "off"]

    def describe(self) -> str:
        return f"{self.led} is {self.state}{self.window_text()}"

    def evaluate(self, run: RunView) -> ExpectationResult:
        """Check the edges of the pin. The LED is dark until its pin is configured."""
        wanted = self.state == "on"
        end_ps = run.end_ps if self.to is None else min(self.to, run.end_ps)
        for begin_ps, until_ps, lit in led_states(run, self.led):
            first_ps, last_ps = max(begin_ps, self.from_), min(until_ps, end_ps)
            if first_ps < last_ps and lit is not wanted:
                seen = f"{'on' if lit else 'off'} from {seconds(first_ps)} to {seconds(last_ps)}"
                return self.failed("wrong value", seen, final=True)
        return self.met()


class _LedSample(NamedTuple):
    """A moment at which the LED must be lit if ``steep`` is True, and otherwise dark."""

    at_ps: int
    angle: float
    steep: bool
    lit: bool
    other_steep: bool
    """Whether the other angle (pitch or roll) is beyond the threshold."""
    since_ps: int
    """The time at which the board reached this side of the threshold."""
    changed: tuple[int, float]
    """Time and angle of the LED's change after the previous sample; without a change, those of this sample."""

    def at_change(self) -> _LedSample:
        return self._replace(at_ps=self.changed[0], angle=self.changed[1])


class ExpectLedFollows(Windowed):
    """A LED is lit if and only if the board is inclined by more than ``beyond_deg``, to either
    side.

    ``angle``: pitch is the inclination of the X axis, roll is the inclination of the Y axis (formulas of the
    slides). The LED may be in either state within ``margin_deg`` of the threshold, and for the time
    ``settle`` after crossing it. ``when``: a condition instead of an angle.
    """

    ON_TERMINAL = False

    kind: Literal["led_follows"]
    led: LedName
    angle: Literal["pitch", "roll"] | None = None
    beyond_deg: float = Field(80.0, gt=0, lt=90)
    margin_deg: float = Field(3.0, ge=0, lt=10)
    when: Condition | None = None
    settle: Duration = 300 * PS_PER_MS

    @model_validator(mode="after")
    def _one_condition(self) -> ExpectLedFollows:
        if (self.angle is None) == (self.when is None):
            raise ValueError("must have either angle = ... or when = { ... }")
        if self.when is not None and self.when.quantity is None:
            raise ValueError("must have a condition on a quantity, not on a LED")
        if self.when is not None and self.model_fields_set & {"beyond_deg", "margin_deg"}:
            raise ValueError(
                "must not have beyond_deg or margin_deg if it has `when`; write beyond and margin in `when`"
            )
        return self

    @property
    def condition(self) -> Condition:
        if self.when is not None:
            return self.when
        return Condition(quantity=self.angle, beyond=self.beyond_deg, margin=self.margin_deg)

    def describe(self) -> str:
        return (
            f"{self.led.upper()} is lit while {self.condition.text()}, and dark otherwise, "
            f"at most {seconds(self.settle)} late{self.window_text()}"
        )

    def followed(self, run: RunView) -> Followed:
        """Return periods of at least 1 ms in which the LED is lit, and the condition's periods."""
        states = ((begin, min(until, run.end_ps)) for begin, until, lit in led_states(run, self.led) if lit)
        lit = tuple((begin, until) for begin, until in states if until - begin >= PS_PER_MS)
        return Followed(self.led.upper(), self.condition.text(), self.condition.held(run), lit)

    def evaluate(self, run: RunView) -> ExpectationResult:
        samples = list(self._samples(run))
        wrong = _wrong(samples, self.settle)
        if not wrong:
            return self.met()
        one_sided = _one_sided(samples, self.settle)
        finding = _finding(samples, wrong, one_sided, self._growing(samples))
        if one_sided is not None and finding == "one side":
            text = self._observed(finding, one_sided.first, one_sided.late_ps, samples)
        else:
            text = self._observed(finding, wrong[0], _latest_ps(wrong), samples)
        return self.failed("wrong value", text, final=True, mistake=finding)

    def _samples(self, run: RunView) -> Iterator[_LedSample]:
        """Yield the samples that are in the window and outside the margin."""
        condition = self.condition
        changes = list(led_states(run, self.led))
        begins = [begin for begin, _, _ in changes]
        side: bool | None = None
        since_ps = 0
        before_ps, before = 0, 0.0
        for at_ps, value, other in self._values(run):
            steep = condition.holds(value)
            if steep is not side:
                side, since_ps = steep, at_ps
            if steep is not None and self.covers(at_ps) and at_ps < run.end_ps:
                begin_ps, _, lit = changes[bisect_right(begins, at_ps) - 1]
                other_steep = condition.beyond is not None and abs(other) > condition.beyond
                changed = at_ps, value
                if begin_ps > before_ps:
                    share = (begin_ps - before_ps) / (at_ps - before_ps)
                    changed = round(begin_ps / PS_PER_MS) * PS_PER_MS, before + share * (value - before)
                yield _LedSample(at_ps, value, steep, lit, other_steep, since_ps, changed)
            before_ps, before = at_ps, value

    def _growing(self, samples: Sequence[_LedSample]) -> Sequence[_LedSample]:
        """Return the samples. For a condition ``below``, invert ``lit`` and ``steep``."""
        if self.condition.below is None:
            return samples
        return [one._replace(lit=not one.lit, steep=not one.steep) for one in samples]

    def _values(self, run: RunView) -> Iterator[tuple[int, float, float]]:
        """Yield (time in ps, value, other inclination or 0) every 10 ms."""
        name = self.condition.quantity or ""
        if name in ("pitch", "roll"):
            for tilt in run.tilts:
                value, other = (tilt.pitch, tilt.roll) if name == "pitch" else (tilt.roll, tilt.pitch)
                yield tilt.at_ps, value, other
            return
        for number, value in enumerate(run.samples[name]):
            yield number * SAMPLE_STEP_PS, value, 0.0

    def _observed(self, finding: str, first: _LedSample, late_ps: int, samples: Sequence[_LedSample]) -> str:
        first = first.at_change()
        state = "lit" if first.lit else "dark"
        quantity = self.condition.quantity or ""
        degrees = unit_text(quantity) if quantity in ("pitch", "roll") else ""
        side = "negative" if first.angle > 0 else "positive"
        late = f", and follows up to {seconds(late_ps)} late" if late_ps else ""
        where = f"at {seconds(first.at_ps)} with a true {quantity} of {first.angle:.1f}{unit_text(quantity)}"
        here = f"{self.led.upper()} is {state} {where}"
        more = {
            "never lit": f" and never lit; check its condition for this {quantity}{degrees and ', in degrees'}",
            "never dark": " and never dark again; check that the program switches it off",
            "inverted": ": lit when it must be dark, and dark when it must be lit",
            "blinks": " and changes while the board does not move",
            "late": f": it follows up to {seconds(late_ps)} late, as if set in main's loop instead of the callback",
            "threshold": f": its threshold is {_threshold_text(self._growing(samples), self.condition)}",
            "other axis": f": it follows {'roll' if quantity == 'pitch' else 'pitch'}",
            "one side": f": it is lit for {side} {'angles' if degrees else 'values'} only{late}",
        }
        return here + more.get(finding, "")


_SLOW_PS = 1_300 * PS_PER_MS  # an update each second, plus the time to print
_STALE_PS = (
    2_400 * PS_PER_MS
)  # one iteration of main()'s loop reads the sensor, and the next iteration switches the LED
_PROMPT_PS = 300 * PS_PER_MS
_RESTING_DEG = 0.01  # degrees in 10 ms; during faster motion the LED lags
_MOSTLY = 0.8
_FEWEST_CHANGES = 3


class _OneSided(NamedTuple):
    """A LED that follows the condition on only one side of zero."""

    first: _LedSample
    """The first wrong sample on the other side."""
    late_ps: int
    """Delay on the correct side, or 0 without a delay."""


def _finding(
    samples: Sequence[_LedSample],
    wrong: Sequence[_LedSample],
    one_sided: _OneSided | None,
    growing: Sequence[_LedSample],
) -> str:
    """Return the kind of mistake, or ""."""
    settled = _settled(samples)
    inverted = sum(one.lit is not one.steep for one in settled)
    kinds = (
        ("never lit", not any(one.lit for one in samples)),
        ("never dark", _stays_lit(samples)),
        ("inverted", bool(settled) and inverted >= _MOSTLY * len(settled)),
        ("other axis", _follows_other(samples)),
        ("one side", one_sided is not None),
        ("threshold", _threshold(growing) is not None),
        ("blinks", _blinks(samples)),
        ("late", _is_late(samples, wrong)),
    )
    return next((kind for kind, holds in kinds if holds), "")


def _wrong(samples: Sequence[_LedSample], settle_ps: int) -> list[_LedSample]:
    return [one for one in samples if one.at_ps - one.since_ps >= settle_ps and one.lit is not one.steep]


def _settled(samples: Sequence[_LedSample]) -> list[_LedSample]:
    """Return samples at which the LED must be correct even if it is updated only every second."""
    return [one for one in samples if one.at_ps - one.since_ps >= _SLOW_PS]


def _latest_ps(wrong: Sequence[_LedSample]) -> int:
    return max((one.at_ps - one.since_ps for one in wrong), default=0)


def _is_late(samples: Sequence[_LedSample], wrong: Sequence[_LedSample]) -> bool:
    """Return whether the LED lags as if the loop in main() updates it."""
    catches_up = all(one.lit is one.steep for one in _settled(samples)) and _catches_up(samples, wrong)
    return catches_up or _shows_the_past(samples)


def _catches_up(samples: Sequence[_LedSample], wrong: Sequence[_LedSample]) -> bool:
    """Return whether the LED became correct each time before the board crossed the threshold again."""
    last = {one.since_ps: one for one in samples}
    return all(last[one.since_ps].lit is one.steep for one in wrong)


def _shows_the_past(samples: Sequence[_LedSample]) -> bool:
    """Return whether the LED always shows a side on which the board was in the preceding 2.4 s."""
    last_ps: dict[bool, int] = {}
    for one in samples:
        last_ps[one.steep] = one.at_ps
        if one.at_ps - last_ps.get(one.lit, -NEVER_PS) > _STALE_PS:
            return False
    return True


def _threshold(samples: Sequence[_LedSample]) -> tuple[float, float] | None:
    """Return the absolute angles between which the LED changes, or None if these angles may be correct."""
    sure = [one for before, one in pairwise(samples) if _is_sure(before, one)]
    lit = min((one for one in sure if one.lit), key=lambda one: abs(one.angle), default=None)
    dark = max((one for one in sure if not one.lit), key=lambda one: abs(one.angle), default=None)
    if lit is None or dark is None or (lit.steep and not dark.steep):
        return None
    return (abs(dark.angle), abs(lit.angle)) if abs(dark.angle) < abs(lit.angle) else None


def _is_sure(before: _LedSample, sample: _LedSample) -> bool:
    """Return whether the board is at rest, or the LED has just changed."""
    grows = abs(sample.angle) - abs(before.angle)
    if abs(grows) < _RESTING_DEG:
        return sample.at_ps - sample.since_ps >= _PROMPT_PS
    return sample.lit is not before.lit and sample.lit is (grows > 0)


def _threshold_text(growing: Sequence[_LedSample], condition: Condition) -> str:
    dark, lit = _threshold(growing) or (0.0, 90.0)
    beyond = condition.beyond
    is_integer = beyond is not None and beyond < dark < beyond + 1
    integers = ", as if abs() of an int were used instead of fabsf()" if is_integer else ""
    return f"between {dark:.1f} and {lit:.1f}{unit_text(condition.quantity or '')}{integers}"


def _follows_other(samples: Sequence[_LedSample]) -> bool:
    """Return whether the LED mostly follows the other angle."""
    lit = [one for one in samples if one.lit]
    other = sum(one.other_steep for one in samples)
    return bool(other) and sum(one.other_steep for one in lit) >= _MOSTLY * max(len(lit), other)


def _stays_lit(samples: Sequence[_LedSample]) -> bool:
    since = next((number for number, one in enumerate(samples) if one.lit), len(samples))
    rest = samples[since:]
    return all(one.lit for one in rest) and any(a.steep and not b.steep for a, b in pairwise(rest))


def _blinks(samples: Sequence[_LedSample]) -> bool:
    stretches = groupby(samples, key=lambda one: one.since_ps)
    changes = (sum(one.lit is not other.lit for one, other in pairwise(stretch)) for _, stretch in stretches)
    return any(count >= _FEWEST_CHANGES for count in changes)


def _one_sided(samples: Sequence[_LedSample], settle_ps: int) -> _OneSided | None:
    for positive in (True, False):
        of_side = _with_one_side(samples, positive)
        wrong = _wrong(of_side, settle_ps)
        dark = [one for one in _wrong(samples, settle_ps) if one.steep and (one.angle > 0) is not positive]
        is_shown = any(one.steep for one in of_side) and any(one.lit for one in samples)
        if not dark or not is_shown:
            continue
        if not wrong or (_settled(dark) and _is_late(of_side, wrong)):
            return _OneSided(dark[0], _latest_ps(wrong))
    return None


def _with_one_side(samples: Sequence[_LedSample], positive: bool) -> list[_LedSample]:
    found: list[_LedSample] = []
    for one in samples:
        steep = one.steep and (one.angle > 0) is positive
        same = bool(found) and found[-1].steep is steep
        found.append(one._replace(steep=steep, since_ps=found[-1].since_ps if same else one.since_ps))
    return found


# -- The timer's ticks, and the hard iron ----------------------------------------------------------------


class ExpectTicks(Expectation):
    """Late ticks, lost ticks and rate of the timer's interrupt."""

    kind: Literal["ticks"]
    late_min: int | None = Field(None, ge=0)
    late_max: int | None = Field(None, ge=0)
    late_percent_max: float | None = Field(None, ge=0, le=100)
    lost_min: int | None = Field(None, ge=0)
    lost_max: int | None = Field(None, ge=0)
    rate_hz: float | None = Field(None, gt=0)
    rate_tolerance_hz: float = Field(0.01, ge=0)

    @model_validator(mode="after")
    def _something(self) -> ExpectTicks:
        bounds = {self.late_min, self.late_max, self.late_percent_max, self.lost_min, self.lost_max}
        if bounds | {self.rate_hz} == {None}:
            raise ValueError(
                "must have one of late_min, late_max, late_percent_max, lost_min, lost_max, rate_hz"
            )
        return self

    def describe(self) -> str:
        """Describe rate and limits. A failure names only the part that is not met."""
        rate = [] if self.rate_hz is None else [f"ticks at {self.rate_hz:g} Hz"]
        bounds = (
            ("at least", self.late_min, "late"),
            ("at most", self.late_max, "late"),
            ("at least", self.lost_min, "lost"),
            ("at most", self.lost_max, "lost"),
        )
        share = [] if self.late_percent_max is None else [f"at most {self.late_percent_max:g} % late"]
        counts = [f"{which} {count} ticks {what}" for which, count, what in bounds if count is not None]
        return ", ".join(rate + share + counts)

    def evaluate(self, run: RunView) -> ExpectationResult:
        timer = run.board.timer
        if timer.ticks == 0:
            return self.failed("missing", "the timer was never started", expected=f"ticks of {timer.name}")
        if self.rate_hz is not None and abs(timer.rate_hz - self.rate_hz) > self.rate_tolerance_hz:
            expected = f"{timer.name} at {self.rate_hz:g} Hz"
            return self.failed("wrong value", f"{timer.rate_hz:.6g} Hz", expected=expected)
        late = self._outside("late", timer.late, self.late_min, self.late_max) or self._too_many_late(timer)
        return late or self._outside("lost", timer.lost, self.lost_min, self.lost_max) or self.met()

    def _too_many_late(self, timer: TickCounts) -> ExpectationResult | None:
        if self.late_percent_max is None or timer.late * 100 <= self.late_percent_max * timer.ticks:
            return None
        text = f"{timer.late} of {timer.ticks} ticks late, by up to {1000 * timer.longest_wait_s:.2f} ms"
        longer = f": the callback takes longer than its {1000 / timer.rate_hz:.3g} ms"
        expected = f"at most {self.late_percent_max:g} % of the ticks late"
        return self.failed("wrong value", text + longer, expected=expected)

    def _outside(self, what: str, count: int, low: int | None, high: int | None) -> ExpectationResult | None:
        if low is not None and count < low:
            return self.failed("wrong value", f"{count}", expected=f"at least {low} ticks {what}")
        if high is not None and count > high:
            expected = f"at most {high} ticks {what}"
            return self.failed("wrong value", f"{count}", expected=expected, final=True)
        return None


class ExpectHardIron(Expectation):
    """At the end of the run, the centre in MagCalibration equals the board's hard iron on each axis."""

    kind: Literal["hard_iron"]
    within_mgauss: float = Field(ge=0)

    def describe(self) -> str:
        return f"mag_min and mag_max give the hard iron within {self.within_mgauss:g} mgauss on each axis"

    def evaluate(self, run: RunView) -> ExpectationResult:
        try:
            low, high = (_axes(run.board.variable(name)) for name in ("mag_min", "mag_max"))
        except (KeyError, AttributeError):
            return self.failed("missing", "the firmware has no variables mag_min and mag_max")
        centre = (low + high) / 2.0
        true = run.board.world.hard_iron_mgauss(run.end_ps / PS_PER_S)[0]
        if np.all(np.abs(centre - true) <= self.within_mgauss):
            return self.met()
        return self.failed("wrong value", f"{_vector(centre)}; the board has {_vector(true)}")


def _axes(axes: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([axes.AXIS_X, axes.AXIS_Y, axes.AXIS_Z], dtype=np.float64)


def _vector(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    return ", ".join(f"{axis} {value:.1f}" for axis, value in zip("xyz", values, strict=True))


# -- Reads on the bus ---------------------------------------------------------------------------------------


@cache
def _outputs() -> dict[str, tuple[str, int, str]]:
    """Return (sensor, address of the first byte, name in the datasheet) for each output."""
    found = {}
    for name, part, first in (
        ("accelerometer", "LSM6DSL", "OUTX_L_XL"),
        ("gyroscope", "LSM6DSL", "OUTX_L_G"),
        ("magnetometer", "LIS2MDL", "OUTX_L_REG"),
        ("barometer", "LPS22HB", "PRESS_OUT_XL"),
    ):
        registers = next(iter(SENSORS[part].maps().values())).registers
        register = next(one for one in registers if first in one.names)
        found[name] = part, register.addr, first
    return found


class ExpectReads(Expectation):
    """A sensor's outputs are read at a given rate. A transfer counts if it contains the first byte."""

    RENAMED: ClassVar[Mapping[str, str]] = {"least_hz": "min_hz", "most_hz": "max_hz"}

    kind: Literal["reads"]
    sensor: Literal["accelerometer", "gyroscope", "magnetometer", "barometer"]
    min_hz: float = Field(0.0, ge=0)
    max_hz: float = Field(1e6, gt=0)
    from_: Duration = Field(2 * PS_PER_S, alias="from")
    for_: Length = Field(PS_PER_S // 4, alias="for")

    def describe(self) -> str:
        part, address, register = _outputs()[self.sensor]
        bounds = f"at least {self.min_hz:g}" if self.min_hz else f"at most {self.max_hz:g}"
        return f"{part} {register} (0x{address:02X}) is read {bounds} times a second"

    def watch(self, board: BoardView) -> list[int]:
        """Count reads only in the window, because counting them slows the run down."""
        part, address, _ = _outputs()[self.sensor]
        counted = [0]

        def count(event: TraceEvent) -> None:
            if isinstance(event, BusTransfer) and event.device == part and event.result == "ok":
                counted[0] += _reaches(event, address)

        def begin() -> None:
            stop = board.trace.subscribe(count)
            board.clock.schedule(self.from_ + self.for_, stop, last=True)

        board.clock.schedule(self.from_, begin)
        return counted

    def evaluate(self, run: RunView) -> ExpectationResult:
        part, address, register = _outputs()[self.sensor]
        watched: list[int] = run.watched.get(id(self), [0])
        if run.end_ps < self.from_ + self.for_:
            return self.met()
        rate_hz = watched[0] / (self.for_ / PS_PER_S)
        if self.min_hz <= rate_hz <= self.max_hz:
            return self.met()
        wanted = f"at least {self.min_hz:g}" if rate_hz < self.min_hz else f"at most {self.max_hz:g}"
        place = f"{part} {register} (0x{address:02X})"
        expected, text = f"{place} is read {wanted} times a second", f"{rate_hz:.0f} times a second"
        if rate_hz >= self.min_hz:
            return self.failed("wrong value", text, expected=expected, final=True)
        text += "; read it in each call of the timer's callback"
        return self.failed("wrong value", text, expected=expected, final=True, mistake="seldom read")


def _reaches(transfer: BusTransfer, address: int) -> bool:
    """Return whether a read includes ``address``. The top bit of the sub-address is a flag."""
    if not transfer.written or not transfer.read:
        return False
    first = transfer.written[0] & 0x7F
    return first <= address < first + len(transfer.read)
