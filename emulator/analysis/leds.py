"""LED problems: a wrong pin, an LED that is on below its angle and off above it, and an LED that toggles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from statistics import median
from typing import NamedTuple

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK, Places
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.chip.firmware import ArmFirmware
from fcu_emulator.emulator.trace import GpioEdge

_STEEP, _FLAT = 85.0, 75.0
_STEADY = 4  # consecutive polls of the LEDs: 0.2 s


class _LedCondition(NamedTuple):
    """An LED's state, and the angle that should control it."""

    at_s: float
    angle: float
    lit: bool
    force_g: float


def led_hints(board: Board, recorder: TruthRecorder) -> Iterator[Diagnosis]:
    """Yield the LEDs' problems if any."""
    leds = board.chip.signals.board.leds if board.chip is not None else {}
    for name, pin in leds.items():
        if board.chip is not None and _is_no_output(board.chip, pin):
            yield Diagnosis(
                "led",
                f"{name} is switched, but its pin P{pin[0]}{pin[1]} is not an output",
                (
                    f"The bit in GPIO{pin[0]}_ODR is set, but MODER sets the pin as an input, as after reset.",
                    f"BSP_LED_Init({name}) is missing; call it before the first BSP_LED_Off(){_first_switch(board.chip)}.",
                ),
                fatal=False,
            )
    if {"LED1", "LED2"} <= board.leds.keys():  # only these LEDs have rules in the lab
        since_s = next((line.at_s for line in recorder.lines if line.label == "Pitch:"), math.inf)
        lights = [one for one in recorder.lights if one.at_s > since_s]
        for name, angle in (("LED1", "pitch"), ("LED2", "roll")):
            looks = [
                _LedCondition(one.at_s, getattr(one, angle), one.lit[name], one.force_g) for one in lights
            ]
            yield from _sides(name, angle, looks)
            yield from _toggled(board, name, angle, looks)


def _first_switch(arm: ArmFirmware) -> str:
    """Return the place of main's first call that switches a LED."""
    places = Places(arm.image)
    start = places.address_of("main")
    call = (
        places.call_of(("BSP_LED_Off", "BSP_LED_On"), start, arm.chip.core.memory)
        if start is not None
        else None
    )
    return f", {places.place(call[0])}" if call is not None else ""


def _is_no_output(arm: ArmFirmware, pin: tuple[str, int]) -> bool:
    port, number = pin
    block = arm.chip.core.peripherals[f"GPIO{port}"]
    return block.peek(0x14) >> number & 1 == 1 and block.peek(0x00) >> 2 * number & 3 == 0


def _side(angle: float) -> int | None:
    if abs(angle) < _FLAT:
        return 0
    return None if abs(angle) < _STEEP else (1 if angle > 0 else -1)


# -- an LED that is lit beyond 80 degrees on one side only, or that is inverted -----------------------------


def _sides(name: str, angle: str, looks: Sequence[_LedCondition]) -> Iterator[Diagnosis]:
    on = {-1: 0, 0: 0, 1: 0}
    off = dict(on)
    for index in range(_STEADY, len(looks)):
        sides = {_side(one.angle) for one in looks[index - _STEADY : index + 1]}
        if len(sides) == 1 and (side := sides.pop()) is not None:
            (on if looks[index].lit else off)[side] += 1
    few = 3 * _STEADY
    for side, dark in ((1, -1), (-1, 1)):
        if on[side] > few and off[dark] > few and not off[side] and not on[dark] and not on[0]:
            beyond = "-80" if dark < 0 else "80"
            yield Diagnosis(
                "led",
                f"{name} is lit when {angle} is beyond {80 * side:+d} degrees, and dark beyond {beyond}",
                (f"Likely fabsf() is missing: if (fabsf({angle}) > 80) is true for both signs.",),
                fatal=False,
            )
    steep_off, steep_on = off[1] + off[-1], on[1] + on[-1]
    if on[0] > few and not off[0] and steep_off > few and not steep_on:
        yield Diagnosis(
            "led",
            f"{name} is dark when {angle} is beyond 80 degrees, and lit otherwise",
            (
                "Check whether BSP_LED_On() and BSP_LED_Off() are exchanged.",
                "The LEDs are lit while their pins are low: GPIO_PIN_RESET lights them.",
            ),
            fatal=False,
        )


# -- an LED that is toggled, so that it is wrong during half of the time -----------------------------------

_FEWEST_EDGES = 4
_STILL_G = 0.05
_REGULAR, _MOSTLY = 0.25, 0.9  # tolerance (share of the usual interval), minimum share of regular intervals
_TOGGLE = "BSP_LED_Toggle"


def _toggled(board: Board, name: str, angle: str, looks: Sequence[_LedCondition]) -> Iterator[Diagnosis]:
    """Yield a diagnosis if an LED changes at regular intervals on a motionless board."""
    pin = board.led(name).pin
    edges_s = [edge.t_s for edge in board.trace.of(GpioEdge) if edge.pin == pin]
    for side, still in groupby(looks, key=lambda one: _side(one.angle) if _is_still(one) else None):
        stretch = list(still)[_STEADY:]
        if side is None or not stretch:
            continue
        from_s, to_s = stretch[0].at_s, stretch[-1].at_s
        interval_s = _regular_interval([at_s for at_s in edges_s if from_s <= at_s <= to_s])
        if interval_s is None:
            continue
        each = abs(interval_s * board.timer.rate_hz - 1) < _REGULAR if board.timer.ticks else False
        every = f"{interval_s:.3g} s" if interval_s >= 0.1 else f"{1000 * interval_s:.3g} ms"
        when = f"while {angle} is {round(stretch[len(stretch) // 2].angle)} degrees"
        yield Diagnosis(
            "led",
            f"{name} is toggled every {every}{', in each callback,' if each else ''} {when}",
            (
                *_toggling_lines(board.chip, each),
                "A toggled LED is wrong half of the time.",
                f"Call BSP_LED_On({name}) if fabsf({angle}) > 80, BSP_LED_Off({name}) otherwise.",
            ),
            fatal=False,
        )
        return


def _is_still(look: _LedCondition) -> bool:
    return abs(look.force_g - 1) < _STILL_G


def _regular_interval(edges_s: Sequence[float]) -> float | None:
    if len(edges_s) < _FEWEST_EDGES:
        return None
    intervals_s = [after - before for before, after in pairwise(edges_s)]
    usual_s = median(intervals_s)
    alike = sum(abs(one - usual_s) <= _REGULAR * usual_s for one in intervals_s)
    return usual_s if alike >= _MOSTLY * len(intervals_s) else None


def _toggling_lines(arm: ArmFirmware | None, in_callback: bool) -> Iterator[str]:
    if arm is None:
        return
    places = Places(arm.image)
    for function in (CALLBACK,) if in_callback else ("main", CALLBACK):
        start = places.address_of(function)
        call = start and places.call_of((_TOGGLE,), start, arm.chip.core.memory)
        if call:
            yield f"{_TOGGLE}() is called from {places.place(call[0])}."
            return
