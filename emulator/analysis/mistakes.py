"""A run's mistakes: problems of the chip, sensors and bus, then hints from wrong printed numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Protocol, TypeVar

from fcu_emulator.emulator.analysis.calibration import calibration_hint
from fcu_emulator.emulator.analysis.field import MAG, field_hint
from fcu_emulator.emulator.analysis.formulas import altitude_hint, tilt_hint, yaw_hint
from fcu_emulator.emulator.analysis.leds import led_hints
from fcu_emulator.emulator.analysis.numbers import (
    ACC,
    ALTITUDE,
    GYR,
    PRESSURE,
    TILT,
    YAW,
    Group,
    Hint,
    always_0,
    hint,
    is_far_off,
    shows_another,
)
from fcu_emulator.emulator.analysis.recorder import LABELS, LabLine, TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK, Places
from fcu_emulator.emulator.chip.diagnosis.exclusive_or import exclusive_or
from fcu_emulator.emulator.chip.diagnosis.printing import PrintedLines
from fcu_emulator.emulator.chip.diagnosis.report import KEEPS_SAMPLES_AWAY, Diagnosis
from fcu_emulator.emulator.chip.firmware import ArmFirmware
from fcu_emulator.emulator.trace import BusTransfer
from fcu_emulator.sensors.lis2mdl import LIS2MDL
from fcu_emulator.sensors.lsm6dsl import LSM6DSL

_GROUPS = (ACC, GYR, MAG, TILT, YAW, PRESSURE, ALTITUDE)
_SHOWN = 90
_READ = "ReadSensorRawData"
_DIVISION = "an integer division"


class _HasData(Protocol):
    @property
    def kind(self) -> str: ...

    @property
    def data(self) -> Mapping[str, str]: ...


_Cause = TypeVar("_Cause", bound=_HasData)


def explain(board: Board, recorder: TruthRecorder, after_failure: bool = False) -> list[Diagnosis]:
    """Return the firmware's problems in this run.

    ``after_failure``: after a fatal problem, also return problems of the sensors' set-up.
    """
    found = board.chip.findings() if board.chip is not None else []
    lines = list(recorder.lines)
    if found and found[0].fatal:
        set_up = [*_switched_off(board, lines), *_blocks(board, lines)] if after_failure else []
        return [*found[:1], *set_up]
    if not lines or any(one.kind in KEEPS_SAMPLES_AWAY for one in found):
        return found
    where = _Where(board.chip)
    judged = [*_misread(board), *_switched_off(board, lines), *_blocks(board, lines)]
    not_numbers = list(_not_a_number(board, lines, where))
    if not (judged or any(one.kind == "printing" for one in found)):
        not_numbers += [] if not_numbers else _misprinted_ints(lines, where)
        judged += _numbers(board, lines, where)
    judged = [*_exclusive_or(board, lines), *judged]
    return [*found, *judged, *not_numbers, *led_hints(board, recorder)]


def without_explained(causes: Iterable[_Cause], formulas: Iterable[Diagnosis]) -> list[_Cause]:
    """Return the causes. Omit comparisons with the truth if ``formulas`` explain the compared fields."""
    explained = {field for one in formulas for field in _fields(one)}
    return [one for one in causes if one.kind != "numbers" or explained.isdisjoint(_fields(one))]


def _fields(cause: _HasData) -> list[str]:
    return cause.data["fields"].split(", ") if "fields" in cause.data else []


class _Where:
    """Search for places in the program: printed lines, functions and calls."""

    def __init__(self, arm: ArmFirmware | None) -> None:
        self._arm = arm
        self._places = Places(arm.image) if arm is not None else None

    def printed(self, line: LabLine) -> int | None:
        """Return the address of the instruction that prints a line."""
        if self._arm is None or self._places is None:
            return None
        found = PrintedLines(self._arm.image, self._places, line.text.encode("latin-1"))
        return found.address(found.lines[0].made_by) if found.lines else None

    def defined(self, function: str) -> int | None:
        """Return the address of a function's first instruction."""
        return self._places.address_of(function) if self._places is not None else None

    def called(self, function: str) -> int | None:
        """Return the address at which the callback or main() calls a function."""
        if self._arm is None or self._places is None:
            return None
        for start in map(self._places.address_of, (CALLBACK, "main")):
            code = self._arm.chip.core.memory
            call = self._places.call_of((function,), start, code) if start is not None else None
            if call is not None:
                return call[0]
        return None

    def place(self, address: int | None) -> str:
        """Return a place such as ``main(), main.c:93``, or an empty string without an address."""
        return self._places.place(address) if self._places is not None and address is not None else ""

    def prefix(self, address: int | None) -> str:
        """Return the place with a colon, as the beginning of a summary."""
        return self._places.prefix(address) if self._places is not None else ""

    def line(self, address: int | None) -> dict[str, str]:
        return self._places.line(address) if self._places is not None else {}


def _shown(line: LabLine) -> str:
    return f'At {line.at_s:.2f} s the terminal shows "{line.text[:_SHOWN]}".'


# -- the program's instructions -----------------------------------------------------------------------------


def _exclusive_or(board: Board, lines: Sequence[LabLine]) -> Iterator[Diagnosis]:
    """If angles or altitude are wrong, yield a diagnosis of the operator ^."""
    if board.chip is None or not any(is_far_off(lines, group) for group in (TILT, ALTITUDE)):
        return
    place = exclusive_or(Places(board.chip.image), board.chip.core.memory)
    if place:
        yield Diagnosis(
            "numbers",
            f"{place}: ^ in C is an exclusive or, not a power",
            ("Write a square as Gy * Gy, and any other power as pow(x, y) with float or double.",),
            fatal=False,
        )


# -- numbers ------------------------------------------------------------------------------------------------


def _numbers(board: Board, lines: Sequence[LabLine], where: _Where) -> Iterator[Diagnosis]:
    """Yield hints about wrong numbers. Omit groups that are computed from a wrong group."""
    wrong: set[str] = set()
    for group in _GROUPS:
        if group.label in wrong or _rests_on(group) & wrong:
            continue
        found = _hint(board, lines, group)
        if found is None and group is YAW:
            yield from _beyond_a_half_turn(lines, where)
        if found is None:
            continue
        wrong.add(group.label if group not in (TILT, YAW) else group.fields[0])
        if found.exchanged_with is not None:
            wrong.add(found.exchanged_with.label)
            both = group, found.exchanged_with
            yield _of_numbers(found, both, where, where.called(_READ), found.sentences)
            continue
        sentences = _full_scale(board, group, found.factor) or found.sentences
        if any(_READ in one for one in sentences) and (read := where.place(where.called(_READ))):
            call = re.compile(rf"({_READ}\([^)]*\))")
            sentences = tuple(call.sub(rf"\1 in {read}", one) for one in sentences)
        if any(_DIVISION in one for one in sentences) and (
            power := where.place(where.defined("getAltitude"))
        ):
            sentences = tuple(one.replace(_DIVISION, f"{_DIVISION} in {power}") for one in sentences)
        yield _of_numbers(found, (group,), where, where.printed(found.line), sentences)


def _of_numbers(
    found: Hint, groups: Sequence[Group], where: _Where, address: int | None, sentences: Iterable[str]
) -> Diagnosis:
    """Return the diagnosis of groups with wrong numbers. ``address``: the instruction that the diagnosis names."""
    group = groups[0]
    truth = ", ".join(
        f"{name} {_number(one.middle)}"
        for name, one in found.line.truth.items()
        if name in group.fields or group.fields[0] not in found.line.truth
    )
    unit = MAG.unit if found.line.label == MAG.label else group.unit
    details = _shown(found.line), f"The truth is {truth} {unit}.", *sentences
    summary = f"{where.prefix(address)}{found.summary}"
    fields = ", ".join(name for one in groups for name in one.fields)
    return Diagnosis("numbers", summary, details, fatal=False, data={"fields": fields, **where.line(address)})


def _hint(board: Board, lines: Sequence[LabLine], group: Group) -> Hint | None:
    iron = board.world.hard_iron_mgauss(board.now_s)[0]
    if group in (ACC, GYR):
        others = [one for one in (ACC, GYR, MAG) if one is not group]
        return shows_another(lines, group, others) or hint(lines, group)
    if group is YAW:
        return yaw_hint(lines, iron) or calibration_hint(lines, iron) or hint(lines, group)
    if group is TILT and always_0(lines, group):
        return tilt_hint(lines) if is_far_off(lines, group) else None
    found = field_hint(lines) if group is MAG else hint(lines, group)
    if found is None and group is TILT:
        return tilt_hint(lines)
    return _altitude_hint(board, lines) if found is None and group is ALTITUDE else found


def _altitude_hint(board: Board, lines: Sequence[LabLine]) -> Hint | None:
    return altitude_hint(lines, float(board.world.temperature_degc(board.now_s)[0]))


_HALF_TURN = 180.5


def _beyond_a_half_turn(lines: Sequence[LabLine], where: _Where) -> Iterator[Diagnosis]:
    bad = [line for line in lines if line.values and abs(line.values.get("Yaw", 0.0)) > _HALF_TURN]
    if len(bad) < 2:
        return
    apart = [
        abs((line.values["Yaw"] - line.truth["Yaw"].middle + 180) % 360 - 180) for line in bad if line.values
    ]
    right = sum(one < YAW.far for one in apart) >= len(bad) / 2
    if right:
        likely = "The yaw is wrong by a full turn: remove the code that makes negative angles positive."
    else:
        likely = "Likely the wrap-around is wrong: subtract 360 above 180 degrees, add 360 below -180, nothing else."
    details = _shown(bad[-1]), "atan2 returns -180 to 180 degrees, like the yaw of the slides.", likely
    place = where.prefix(where.printed(bad[-1]))
    yield Diagnosis("numbers", f"{place}Yaw is beyond 180 degrees", details, fatal=False)


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100 else f"{round(value, 3) + 0.0:.3g}"


_ACC_MG = {0: (2, 0.061), 1: (16, 0.488), 2: (4, 0.122), 3: (8, 0.244)}  # by FS_XL (LSM6DSL datasheet 9.13)
_GYR_MDPS = {0: (250, 8.75), 1: (500, 17.5), 2: (1000, 35.0), 3: (2000, 70.0)}  # by FS_G (9.14)


def _full_scale(board: Board, group: Group, factor: float) -> tuple[str, ...]:
    """Return the configured and assumed sensitivities, if their ratio is ``factor``."""
    if group not in (ACC, GYR) or not factor:
        return ()
    address, unit, known = (0x10, "g", _ACC_MG) if group is ACC else (0x11, "dps", _GYR_MDPS)
    register = board.sensors.lsm6dsl.registers.mem[address]
    scale, right = known[register >> 2 & 3]
    for other, used in known.values():
        if abs(used / right / factor - 1) < 0.1:
            name = "CTRL1_XL" if group is ACC else "CTRL2_G"
            return (
                f"{name} is 0x{register:02X}: full scale +-{scale} {unit}, {right:g} {group.unit}/LSB.",
                f"The numbers fit {used:g} {group.unit}/LSB, the factor of +-{other} {unit}.",
            )
    return ()


def _rests_on(group: Group) -> set[str]:
    if group in (TILT, MAG):  # a mistake in one vector also affects the other vector
        return {ACC.label}
    if group is YAW:
        return {ACC.label, MAG.label, "Pitch"}
    return {PRESSURE.label} if group is ALTITUDE else set()


_INVERSE = ("asin", "asinf", "acos", "acosf", "sqrt", "sqrtf", "pow", "powf", "log", "logf")


def _not_a_number(board: Board, lines: Sequence[LabLine], where: _Where) -> Iterator[Diagnosis]:
    for label in LABELS:
        bad = [line for line in lines if line.label == label and re.search(r"\b(nan|inf)\b", line.text)]
        if len(bad) < 2:
            continue
        places = Places(board.chip.image) if board.chip is not None else None
        called = [f"{name}()" for name in _INVERSE if places and places.address_of(name) is not None]
        sentences = [_shown(bad[-1])]
        if any(name[:4] in ("asin", "acos") for name in called):
            sentences.append(
                "asin and acos accept -1 to 1. An acceleration in mg is outside this range, and with noise "
                "1 g can be outside, too. "
                "Use the slides' atan2, which has no such limit."
            )
        if called:
            sentences.append(
                f"The program has these functions, which can return nan or inf: {', '.join(called)}."
            )
        sentences.append("0 / 0 and the root or logarithm of a negative number are nan; x / 0 is inf.")
        what = "nan" if "nan" in bad[-1].text else "inf"
        summary = f"{where.prefix(where.printed(bad[-1]))}{what} is printed, which is not a number"
        yield Diagnosis("numbers", summary, tuple(sentences), fatal=False)


def _misprinted_ints(lines: Sequence[LabLine], where: _Where) -> Iterator[Diagnosis]:
    """Yield a diagnosis for each wrong vector whose ints are printed as doubles."""
    for group in (ACC, GYR):
        printed = [line for line in lines if line.label == group.label and line.values is None]
        wrong = []
        for line in printed:
            numbers = re.findall(r"-?\d+\.\d+", line.text)
            truth = list(line.truth.values())
            if len(numbers) == len(truth) and any(
                one.distance(float(number)) > group.far for number, one in zip(numbers, truth, strict=True)
            ):
                wrong.append(line)
        if len(wrong) >= 2 and len(wrong) == len(printed):
            name, place = group.label[:3], where.prefix(where.printed(wrong[-1]))
            yield Diagnosis(
                "printing",
                f"{place}likely %f for an int: {name} is printed with a decimal point and is wrong",
                (
                    _shown(wrong[-1]),
                    "%f reads the bits of two ints as a double; print int32_t with %d.",
                    "The compiler warns about it (-Wall, -Wformat).",
                ),
                fatal=False,
            )


# -- the sensors' registers and the bus ---------------------------------------------------------------------

_PAIRS = {
    LSM6DSL.NAME: (*range(0x20, 0x2E),),  # OUT_TEMP, OUT_G, OUT_XL
    LIS2MDL.NAME: (*range(0x68, 0x70),),
}


def _misread(board: Board) -> Iterator[Diagnosis]:
    reads = [one for one in board.recent_transfers() if one.read and one.written]
    for one in reads:
        first = one.written[0] & 0x7F
        if first % 2 and len(one.read) > 1 and first in _PAIRS.get(one.device, ()):
            yield Diagnosis(
                "bus",
                f"{one.device} is read from {one.register} (0x{first:02X}), the high byte of a value",
                (
                    "So each number consists of the high byte of one value and the low byte of the next.",
                    f"The low byte comes first, at 0x{first - 1:02X}.",
                ),
                fatal=False,
            )
            return
    yield from _same_twice(reads)


def _same_twice(reads: Sequence[BusTransfer]) -> Iterator[Diagnosis]:
    """Yield a diagnosis if one of two sensors is read twice and the other sensor is not read."""
    bursts = [one.written[0] for one in reads if one.device == LSM6DSL.NAME and len(one.read) == 6]
    for twice, never, what in ((0x22, 0x28, "accelerometer"), (0x28, 0x22, "gyroscope")):
        if bursts.count(twice) >= 3 and never not in bursts and len(bursts) == len(reads) - _others(reads):
            yield Diagnosis(
                "bus",
                f"the {what}'s registers (0x{never:02X}) are not read; the registers at 0x{twice:02X} are read twice",
                (
                    "The gyroscope's registers begin at OUTX_L_G (0x22), the accelerometer's at OUTX_L_XL (0x28).",
                ),
                fatal=False,
            )


def _others(reads: Sequence[BusTransfer]) -> int:
    return sum(1 for one in reads if one.device != LSM6DSL.NAME)


def _switched_off(board: Board, lines: Sequence[LabLine]) -> Iterator[Diagnosis]:
    labels = {line.label for line in lines}
    lsm6dsl, lis2mdl = board.sensors.lsm6dsl.registers.mem, board.sensors.lis2mdl.registers.mem
    off = (
        (ACC.label, lsm6dsl[0x10] >> 4 == 0, "accelerometer", "ODR_XL in the LSM6DSL's CTRL1_XL (10h)"),
        (GYR.label, lsm6dsl[0x11] >> 4 == 0, "gyroscope", "ODR_G in the LSM6DSL's CTRL2_G (11h)"),
        (MAG.label, lis2mdl[0x60] & 2, "magnetometer", "MD in the LIS2MDL's CFG_REG_A (60h)"),
    )
    for label, is_off, what, field in off:
        if label in labels and is_off:
            wanted = "2 or 3, idle" if what == "magnetometer" else "0, power-down"
            yield Diagnosis(
                "sensor",
                f"the {what} is not switched on, but {label[:3]} is printed",
                (
                    f"{field} is {wanted}, so the output registers do not change.",
                    "Call enableAllSensors() after initializeAllSensors().",
                ),
                fatal=False,
            )


def _blocks(board: Board, lines: Sequence[LabLine]) -> Iterator[Diagnosis]:
    """Report sensors whose two-byte values may mix bytes of two samples."""
    labels = {line.label for line in lines}
    lsm6dsl, lis2mdl = board.sensors.lsm6dsl.registers.mem, board.sensors.lis2mdl.registers.mem
    without = [
        name
        for name, label, bit in (
            ("LSM6DSL (BDU in CTRL3_C, 12h)", ACC.label, lsm6dsl[0x12] & 0x40),
            ("LIS2MDL (BDU in CFG_REG_C, 62h)", MAG.label, lis2mdl[0x62] & 0x10),
        )
        if label in labels and not bit
    ]
    if without:
        yield Diagnosis(
            "sensor",
            f"block data update is off in the {' and the '.join(without)}",
            (
                "A new sample can arrive between the reads of the low and the high byte: some values are wrong by 256 LSB.",
                "With BDU = 1 the sensor keeps a value until both bytes have been read.",
            ),
            fatal=False,
        )
