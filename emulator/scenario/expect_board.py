"""Expectations about numbers and hardware: a printed field, a LED, the timer's ticks, the hard iron found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from emulator.scenario.expectation import Expectation, Seen, Windowed
from emulator.scenario.printed import FIELDS, FORMAT_OF_FIELD, visible
from emulator.scenario.recorder import MAX_SETTLE_PS, Line
from emulator.scenario.result import Miss
from emulator.scenario.truth import deviation
from emulator.scenario.units import Duration
from emulator.time.clock import NEVER_PS, PS_PER_MS, PS_PER_S
from emulator.time.durations import seconds, shown
from emulator.trace import GpioEdge

SETTLE_PS = 50 * PS_PER_MS  # one period of the slowest sensor (the LPS22HB at 25 Hz) and ten of the timer's
_DIFF_LINES = 3  # deviating lines that a finding shows


def _known_field(name: str) -> str:
    if name not in FIELDS:
        raise ValueError(f"is {shown(name)}; known: {', '.join(FIELDS)}")
    return name


FieldName = Annotated[str, AfterValidator(_known_field), Field(json_schema_extra={"enum": list(FIELDS)})]


class ExpectField(Windowed):
    """A number printed in the window is near ``value``, or near the truth, each time it is printed.

    Near the truth means: within ``tolerance`` of a value that the truth had in the time ``settle`` before the
    line's printing began, because what is printed was measured a little earlier (LPS22HB: 40 ms).
    """

    kind: Literal["field"]
    name: FieldName
    value: float | None = None
    truth: bool = False
    tolerance: float = Field(ge=0)
    settle: Duration = SETTLE_PS

    @model_validator(mode="after")
    def _one_reference(self) -> ExpectField:
        if (self.value is None) == (not self.truth):
            raise ValueError("needs either value = ... or truth = true")
        if self.settle > MAX_SETTLE_PS:
            raise ValueError(f'settle is {seconds(self.settle)}; give at most "1s"')
        return self

    def judge(self, seen: Seen) -> Miss | None:
        """Missing when it is never printed; a line that begins like it in another format fails too."""
        line_format = FORMAT_OF_FIELD[self.name]
        lines = [line for line in self.lines_in_window(seen) if line.text.startswith(line_format.label)]
        if not lines:
            seen_text = f'no line "{line_format.text}" among {len(seen.lines)}'
            return Miss("missing", self._expected(), seen_text)
        numbers = [(line, line_format.parse(line.text)) for line in lines]
        malformed = [line for line, fields in numbers if fields is None]
        if malformed:
            seen_text = f"{len(malformed)} of {len(lines)} lines in another format"
            diff = (f"-{line_format.text}", *map(_printed, malformed[:_DIFF_LINES]))
            return Miss("wrong format", self._expected(), seen_text, diff)
        errors = [(line, self._error(line, fields[self.name])) for line, fields in numbers if fields]
        wrong = [(line, error) for line, error in errors if not abs(error) <= self.tolerance]
        if not wrong:
            return None
        largest = max((abs(error) for _, error in wrong), default=0.0)
        seen_text = f"{len(wrong)} of {len(lines)} prints off by up to {largest:.6g}"
        diff = tuple(f"{_printed(line)}  (off by {error:+.6g})" for line, error in wrong[:_DIFF_LINES])
        return Miss("wrong value", self._expected(), seen_text, diff)

    def _error(self, line: Line, printed: float) -> float:
        if self.value is not None:
            return deviation(self.name, printed, self.value)
        return line.error(self.name, printed, self.settle)

    def _expected(self) -> str:
        reference = "the truth" if self.value is None else f"{self.value:g}"
        return f"{self.name} within {self.tolerance:g} of {reference}{self.window_text()}"


def _printed(line: Line) -> str:
    return f"+{visible(line.text)}  at {seconds(line.at_ps)}"


class ExpectLed(Windowed):
    """A LED is on, or off, throughout the window."""

    kind: Literal["led"]
    led: Literal["led1", "led2"]
    state: Literal["on", "off"]

    def judge(self, seen: Seen) -> Miss | None:
        """From the edges of its pin in the trace; before the pin is set up the LED is dark."""
        wanted = self.state == "on"
        end_ps = seen.end_ps if self.to is None else min(self.to, seen.end_ps)
        for begin_ps, until_ps, lit in self._states(seen):
            first_ps, last_ps = max(begin_ps, self.from_), min(until_ps, end_ps)
            if first_ps < last_ps and lit is not wanted:
                seen_text = f"{'on' if lit else 'off'} from {seconds(first_ps)} to {seconds(last_ps)}"
                return Miss("wrong value", f"{self.led} {self.state}{self.window_text()}", seen_text)
        return None

    def _states(self, seen: Seen) -> Iterator[tuple[int, int, bool]]:
        """(from, until, lit) one after the other."""
        pin = (seen.board.led1 if self.led == "led1" else seen.board.led2).pin
        begin_ps, lit = 0, False
        for edge in seen.board.trace.of(GpioEdge):
            if edge.pin == pin:
                yield begin_ps, edge.t_ps, lit
                begin_ps, lit = edge.t_ps, edge.level == 0
        yield begin_ps, NEVER_PS, lit


class ExpectTicks(Expectation):
    """How the timer's interrupt did: ticks late and lost, and its rate as configured."""

    kind: Literal["ticks"]
    late_min: int | None = Field(None, ge=0)
    late_max: int | None = Field(None, ge=0)
    lost_min: int | None = Field(None, ge=0)
    lost_max: int | None = Field(None, ge=0)
    rate_hz: float | None = Field(None, gt=0)
    rate_tolerance_hz: float = Field(0.01, ge=0)

    @model_validator(mode="after")
    def _something(self) -> ExpectTicks:
        if {self.late_min, self.late_max, self.lost_min, self.lost_max, self.rate_hz} == {None}:
            raise ValueError("needs one of late_min, late_max, lost_min, lost_max, rate_hz")
        return self

    def judge(self, seen: Seen) -> Miss | None:
        """Of TIM9 at the end of the run."""
        timer = seen.board.tim9
        if timer.ticks == 0:
            return Miss("missing", "ticks of TIM9", "the timer was never started")
        if self.rate_hz is not None and abs(timer.rate_hz - self.rate_hz) > self.rate_tolerance_hz:
            return Miss("wrong value", f"TIM9 at {self.rate_hz:g} Hz", f"{timer.rate_hz:.6g} Hz")
        late = _outside("late", timer.late, self.late_min, self.late_max)
        return late or _outside("lost", timer.lost, self.lost_min, self.lost_max)


def _outside(what: str, count: int, low: int | None, high: int | None) -> Miss | None:
    if low is not None and count < low:
        return Miss("wrong value", f"at least {low} ticks {what}", f"{count}")
    if high is not None and count > high:
        return Miss("wrong value", f"at most {high} ticks {what}", f"{count}")
    return None


class ExpectHardIron(Expectation):
    """At the end MagCalibration's centre is the board's hard iron, on each axis."""

    kind: Literal["hard_iron"]
    within_mgauss: float = Field(ge=0)

    def judge(self, seen: Seen) -> Miss | None:
        """(mag_min + mag_max) / 2 of the firmware's variables against the world."""
        expected = f"hard iron found within {self.within_mgauss:g} mgauss on each axis"
        try:
            low, high = (_axes(seen.board.variable(name)) for name in ("mag_min", "mag_max"))
        except (KeyError, AttributeError):
            return Miss("missing", expected, "the firmware has no variables mag_min and mag_max")
        centre = (low + high) / 2.0
        true = seen.board.world.hard_iron_mgauss(seen.end_ps / PS_PER_S)[0]
        if np.all(np.abs(centre - true) <= self.within_mgauss):
            return None
        return Miss("wrong value", expected, f"{_vector(centre)} where the board has {_vector(true)}")


def _axes(axes: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([axes.AXIS_X, axes.AXIS_Y, axes.AXIS_Z], dtype=np.float64)


def _vector(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    return f"({', '.join(f'{value:.1f}' for value in values)})"
