"""Warnings about margins that are too large for a useful test, or too small for correct programs.

Decision: the sensors' error is the largest error of :data:`BOARDS` random boards, with three standard
deviations of noise and of pressure drift. The sum of all limits in the datasheets was rejected,
because no real board has such an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from fcu_emulator.emulator.boards.description import BoardErrors, SensorSettings
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.grading.rubric import CheckTable, Rubric
from fcu_emulator.emulator.scenario.conditions import Condition, unit_text
from fcu_emulator.emulator.scenario.following import ExpectLineFollows
from fcu_emulator.emulator.scenario.hardware import ExpectLedFollows
from fcu_emulator.emulator.scenario.loader import thresholds_at_ends
from fcu_emulator.emulator.scenario.run_view import lab_angles
from fcu_emulator.emulator.scenario.scenario import Scenario
from fcu_emulator.emulator.scenario.thresholds import ThresholdTable
from fcu_emulator.sensors.errors import SIGMAS
from fcu_emulator.sensors.front_end import Deviation
from fcu_emulator.sensors.lps22hb.barometer import BarometerSettings
from fcu_emulator.sensors.lps22hb.declaration import LPS22HBErrors
from fcu_emulator.sensors.lsm6dsl.declaration import LSM6DSLErrors

BOARDS = 200
"""Number of random boards, with seeds from 0."""
_TEMPLATE_ACC_HZ = 20.0  # noise bandwidth with the template's settings: ODR / 400
_TEMPLATE_BAROMETER = BarometerSettings(Fraction(25), low_current=True, divisor=0)
_METRES_PER_HPA = 9.0
_ON_BOARD = next(
    np.array(next(iter(mounted.mountings.values())))
    for mounted in FCU001V1.parts
    if mounted.part.ERRORS is LSM6DSLErrors
)
"""Rotation from board to accelerometer axes."""


# -- Error of a correct program -----------------------------------------------------------------------------


def sensor_error(
    quantity: str, value: float, settings: SensorSettings, board: BoardErrors | None = None
) -> float | None:
    """Return a correct program's largest error near plus or minus ``value``, or None.

    ``board``: deviations of the board, by default random for the sensors' quality.
    """
    wander_hpa = (board or BoardErrors.of_quality(settings.quality, 0)).pressure_wander_hpa
    if quantity.lower() in ("pitch", "roll"):
        return _largest(LSM6DSLErrors, "lsm6dsl", settings, lambda one: _tilt_error(one, quantity, value))
    if quantity == "Pre":
        return _largest(LPS22HBErrors, "lps22hb", settings, lambda one: _pressure_error(one, wander_hpa))
    if quantity == "Altitude":
        return _largest(LPS22HBErrors, "lps22hb", settings, lambda one: _altitude_error(one, wander_hpa))
    return None


def _largest(part: Any, key: str, settings: SensorSettings, error: Callable[[Any], float]) -> float:
    figures: Mapping[str, Any] = settings.figures.get(key, {})
    boards = (replace(part.of_quality(settings.quality, seed), **figures) for seed in range(BOARDS))
    return round(max(map(error, boards)), 6)


def _tilt_error(errors: LSM6DSLErrors, quantity: str, value: float) -> float:
    column = 0 if quantity.lower() == "pitch" else 1
    angles = np.radians([value, -value])
    force_g = np.zeros((2, 3))
    force_g[:, column] = -np.sin(angles) if column == 0 else np.sin(angles)
    force_g[:, 2] = np.cos(angles)
    deviation = Deviation(
        errors.acc_bias_mg, errors.acc_scale_percent, cross_axis_percent=errors.acc_cross_axis_percent
    )
    sensed_mg = 1000 * force_g @ (errors.mounted() @ _ON_BOARD).T
    measured_mg = deviation.apply(sensed_mg, np.zeros(2), np.zeros_like)
    shown = lab_angles(measured_mg.T @ _ON_BOARD)[column]
    noise_deg = math.degrees(SIGMAS * errors.acc_noise_ug_rthz * math.sqrt(_TEMPLATE_ACC_HZ) * 1e-6)
    return float(np.abs(shown - np.degrees(angles)).max()) + noise_deg


def _pressure_noise(errors: LPS22HBErrors, wander_hpa: float) -> float:
    noise_hpa = errors.pressure_noise_hpa * _TEMPLATE_BAROMETER.conversion_noise()
    return SIGMAS * math.hypot(noise_hpa, wander_hpa)


def _pressure_error(errors: LPS22HBErrors, wander_hpa: float) -> float:
    """Return the sum of offset, slope at the ends of the range, and noise, in hPa."""
    offset_hpa = abs(errors.pressure_bias_hpa) + abs(errors.pressure_relative_hpa)
    return offset_hpa + _pressure_noise(errors, wander_hpa)


def _altitude_error(errors: LPS22HBErrors, wander_hpa: float) -> float:
    """Return the noise in metres. An offset has no effect on a difference of pressures."""
    return _METRES_PER_HPA * math.sqrt(2) * _pressure_noise(errors, wander_hpa)


# -- Margins of a rubric ------------------------------------------------------------------------------------


class _Margin(NamedTuple):
    quantity: str
    value: float
    least: float
    most: float
    place: str


def margin_warnings(rubric: Rubric) -> Iterator[str]:
    """Yield warnings of useless and unfair margins."""
    for run in rubric.runs:
        thresholds = [
            _of_threshold(run, number, *ends) for number, ends in enumerate(_thresholds(rubric, run))
        ]
        conditions = list(_conditions(rubric, run))
        yield from _never_tested(conditions, thresholds)
        yield from _unfair(run, [*conditions, *thresholds], rubric.scenario(run, 0))


def _never_tested(conditions: list[_Margin], thresholds: list[_Margin]) -> Iterator[str]:
    for one in conditions:
        near = [each for each in thresholds if (each.quantity, each.value) == (one.quantity, one.value)]
        least = min(near, key=lambda each: each.least, default=None)
        if least is not None and one.most >= least.least:
            yield (
                f"{one.place} accepts either result within {one.most:g} of {one.quantity} {one.value:g}, but the "
                f"board stops only {least.least:g} away from this value ({least.place}), so the threshold is not "
                f"tested; give the condition a margin below {least.least:g}"
            )


def _unfair(run: str, margins: list[_Margin], scenario: Scenario) -> Iterator[str]:
    settings = scenario.sensor_settings()
    board = scenario.board_errors(settings.quality, 0)
    for quantity, value in dict.fromkeys((one.quantity, one.value) for one in margins):
        error = sensor_error(quantity, value, settings, board)
        here = [one for one in margins if (one.quantity, one.value) == (quantity, value)]
        small = [f"{one.place} ({one.least:g})" for one in here if error is not None and one.least < error]
        if small:
            size = f"{error:.2g}{unit_text(quantity)}"
            yield (
                f"in run {run} {settings.quality} sensors show {quantity} {value:g} with an error of up to {size} "
                f"(the largest of {BOARDS} boards), so correct programs can fail with the margin of "
                f'{", ".join(small)}; give larger margins, or add to the run: sensors = {{ quality = "ideal" }}'
            )


def _thresholds(rubric: Rubric, run: str) -> list[tuple[ThresholdTable, ThresholdTable]]:
    return thresholds_at_ends(rubric.table_of(run), rubric.file)


def _of_threshold(run: str, number: int, low: ThresholdTable, high: ThresholdTable) -> _Margin:
    least, most = sorted((low.margin, high.margin))
    return _Margin(low.quantity, low.value, least, most, f"run.{run}.threshold[{number}]")


def _conditions(rubric: Rubric, run: str) -> Iterator[_Margin]:
    for exercise in rubric.exercises:
        for check in exercise.check:
            if rubric.run_of(exercise, check) == run:
                for number, one in enumerate(_conditions_of(check)):
                    if one.quantity is not None:
                        place = f"{exercise.id}.{check.id}{f' condition {number + 1}' if number else ''}"
                        yield _Margin(one.quantity, abs(one.limit), one.margin, one.margin, place)


def _conditions_of(check: CheckTable) -> Iterator[Condition]:
    for one in check.expect:
        if isinstance(one, ExpectLedFollows):
            yield one.condition
        elif isinstance(one, ExpectLineFollows):
            yield one.when
