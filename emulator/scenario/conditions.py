"""Conditions on the truth or on a LED::

    when = { quantity = "roll", beyond = 45, margin = 1 }

Within ``margin`` of the threshold, both states of the LED or line are correct.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from fcu_emulator.emulator.clock import NEVER_PS
from fcu_emulator.emulator.scenario.expectations import QuantityName, RunView
from fcu_emulator.emulator.scenario.fields import LED_NAMES, Table, board_of
from fcu_emulator.emulator.scenario.run_view import SAMPLE_STEP_PS, deviation, unit_of
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.trace import GpioEdge

# -- LEDs ---------------------------------------------------------------------------------------------------


def _known_led(name: str, info: ValidationInfo) -> str:
    known = [led.lower() for led in board_of(info).leds]
    if name not in known:
        raise ValueError(f"must be {' or '.join(map(repr, known))}, not {shown(name)}")
    return name


LedName = Annotated[str, AfterValidator(_known_led), Field(json_schema_extra={"enum": LED_NAMES})]


def led_states(run: RunView, led: str) -> Iterator[tuple[int, int, bool]]:
    """Yield (from, until, lit) in order of time. The LED is dark at first."""
    pin = run.board.led(led.upper()).pin
    begin_ps, lit = 0, False
    for edge in run.board.trace.of(GpioEdge):
        if edge.pin == pin:
            yield begin_ps, edge.t_ps, lit
            begin_ps, lit = edge.t_ps, edge.level == 0
    yield begin_ps, NEVER_PS, lit


# -- A condition --------------------------------------------------------------------------------------------


class Stretch(NamedTuple):
    """A period in which a condition does not change. ``holds`` is None within the margin."""

    begin_ps: int
    end_ps: int
    holds: bool | None


class Followed(NamedTuple):
    """Periods in ps in which a condition was true, and periods in which its LED was lit or its line was printed."""

    name: str
    condition: str
    wanted: tuple[tuple[int, int], ...]
    shown: tuple[tuple[int, int], ...]


def unit_text(quantity: str) -> str:
    """Return a suffix such as " degrees" or " hPa"."""
    return " degrees" if quantity.lower() in ("pitch", "roll", "yaw") else f" {unit_of(quantity)}"


class Condition(Table):
    """A quantity is ``beyond`` (on either side), ``above`` or ``below`` a value, or a LED is lit."""

    quantity: QuantityName | None = None
    beyond: float | None = Field(None, gt=0)
    above: float | None = None
    below: float | None = None
    margin: float = Field(0.0, ge=0)
    led: LedName | None = None

    @model_validator(mode="after")
    def _one_of_each(self) -> Condition:
        if (self.quantity is None) == (self.led is None):
            raise ValueError("must have either quantity = ... or led = ...")
        limits = sum(limit is not None for limit in (self.beyond, self.above, self.below))
        if self.quantity is not None and limits != 1:
            raise ValueError("must have exactly one of beyond, above and below")
        if self.led is not None and (limits or self.margin):
            raise ValueError("must have no threshold and no margin, because it has a LED")
        return self

    @property
    def limit(self) -> float:
        """Return the threshold, or 0 for a LED."""
        return next(one for one in (self.beyond, self.above, self.below, 0.0) if one is not None)

    def text(self) -> str:
        if self.led is not None:
            return f"{self.led.upper()} is lit"
        unit = unit_text(self.quantity or "")
        if self.beyond is not None:
            return f"{self.quantity} is above {self.beyond:g} or below {-self.beyond:g}{unit}"
        return f"{self.quantity} is {'above' if self.above is not None else 'below'} {self.limit:g}{unit}"

    def holds(self, value: float) -> bool | None:
        """Return whether the condition is true, or None within the margin."""
        over = (abs(value) if self.beyond is not None else value) - self.limit
        if abs(over) < self.margin:
            return None
        return over < 0 if self.below is not None else over > 0

    def stretches(self, run: RunView) -> Iterator[Stretch]:
        if self.led is not None:
            for begin_ps, until_ps, lit in led_states(run, self.led):
                if begin_ps < run.end_ps:
                    yield Stretch(begin_ps, min(until_ps, run.end_ps), lit)
            return
        at_ps = 0
        for holds, samples in groupby(run.samples[self.quantity or ""], key=self.holds):
            end_ps = at_ps + SAMPLE_STEP_PS * sum(1 for _ in samples)
            if at_ps < run.end_ps:
                yield Stretch(at_ps, min(end_ps, run.end_ps), holds)
            at_ps = end_ps

    def held(self, run: RunView) -> tuple[tuple[int, int], ...]:
        """Return the periods in ps in which the condition is true."""
        return tuple((one.begin_ps, one.end_ps) for one in self.stretches(run) if one.holds)

    def value_text(self, run: RunView, at_ps: int) -> str:
        """Describe the true value, such as " with a true roll of 44.2 degrees"."""
        if self.led is not None:
            return ""
        name = self.quantity or ""
        samples = run.samples[name]
        index, rest_ps = divmod(at_ps, SAMPLE_STEP_PS)
        before, after = (samples[min(one, len(samples) - 1)] for one in (index, index + 1))
        value = before + deviation(name, after, before) * rest_ps / SAMPLE_STEP_PS
        return f" with a true {name} of {value:.4g}{unit_text(name)}"
