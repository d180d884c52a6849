"""The table ``[explain]`` of a rubric: the lab's arithmetic, which explains wrong numbers.

::

    [explain.inputs]                   # numbers of the sensors' registers
    acc_raw_x = { sensor = "LSM6DSL", register = 0x28 }

    [explain.formulas]                 # each uses inputs and formulas above it
    acc_x = "trunc(acc_raw_x * 0.122)"

    [explain.shows]                    # in the order of a check's expectations
    "1.acc" = ["acc_x"]

    [[explain.call]]                   # a function that must be called, if the program has it
    function = "MagCalibration"
    caller = "HAL_TIM_PeriodElapsedCallback"
    checks = ["5.yaw"]

Decision: the formulas affect no points. The formulas only explain failures, so that a mistake in
the formulas costs no points.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.explain.calls import LabCall
from fcu_emulator.emulator.explain.explanation import Alternative, Arithmetic
from fcu_emulator.emulator.explain.expression import CONSTANTS, FUNCTIONS, FormulaError, Node, names, parse
from fcu_emulator.emulator.explain.probe import InputRegister
from fcu_emulator.emulator.scenario.fields import Table
from fcu_emulator.emulator.text import shown

_SENSORS = tuple(mounted.part.NAME for mounted in FCU001V1.parts)
_MOST = 100


def _formula(value: object) -> str:
    if not isinstance(value, str):
        raise PydanticCustomError(
            "formula", "must be a formula in quotes, not {value}", {"value": shown(value)}
        )
    try:
        parse(value)
    except FormulaError as error:
        raise PydanticCustomError("formula", "{problem}", {"problem": str(error)}) from None
    return value


FormulaName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}$")]
CName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,62}$")]
FormulaText = Annotated[str, BeforeValidator(_formula)]


class InputTable(Table):
    """The first register of a signed little-endian number of ``bytes`` bytes."""

    sensor: str
    register_: int = Field(alias="register", ge=0, le=0x7F)
    bytes: int = Field(2, ge=1, le=4)

    @model_validator(mode="after")
    def _known_sensor(self) -> InputTable:
        if self.sensor not in _SENSORS:
            raise ValueError(f"must have a sensor of {', '.join(_SENSORS)}, not {shown(self.sensor)}")
        return self


class AlternativeTable(Table):
    """Other correct formulas, except for the checks ``not_for``."""

    formulas: dict[FormulaName, FormulaText] = Field(min_length=1, max_length=_MOST)
    not_for: list[str] = Field(default_factory=list, max_length=_MOST)


class CallTable(Table):
    """A function that ``caller`` must call, because the numbers of ``checks`` need it."""

    function: CName
    caller: CName
    checks: list[str] = Field(min_length=1, max_length=_MOST)


class ExplainTable(Table):
    """The rubric's table ``[explain]``."""

    inputs: dict[FormulaName, InputTable] = Field(min_length=1, max_length=_MOST)
    formulas: dict[FormulaName, FormulaText] = Field(min_length=1, max_length=_MOST)
    alternative: list[AlternativeTable] = Field(default_factory=list, max_length=10)
    shows: dict[str, list[FormulaName]] = Field(min_length=1, max_length=_MOST)
    call: list[CallTable] = Field(default_factory=list, max_length=_MOST)

    @model_validator(mode="after")
    def _names_are_known(self) -> ExplainTable:
        known = set(self.inputs)
        for name, formula in self.formulas.items():
            if name in known or name in FUNCTIONS or name in CONSTANTS:
                raise ValueError(f"must define each name once, but {name} is defined twice or is a function")
            _refuse_unknown(name, formula, known)
            known.add(name)
        for changed in self.alternative:
            for name, formula in changed.formulas.items():
                if name not in self.formulas:
                    raise ValueError(f"alternative {name} must be one of the formulas")
                order = list(self.formulas)
                _refuse_unknown(name, formula, {*self.inputs, *order[: order.index(name)]})
        for check, shown_ones in self.shows.items():
            unknown = [one for one in shown_ones if one not in self.formulas]
            if unknown:
                raise ValueError(f"shows.{check} must name formulas, not {unknown[0]}")
        return self

    def arithmetic(self) -> Arithmetic:
        """Return the checked formulas."""
        inputs = {
            name: InputRegister(one.sensor, one.register_, one.bytes) for name, one in self.inputs.items()
        }
        alternatives = (Alternative(_trees(one.formulas), frozenset(one.not_for)) for one in self.alternative)
        return Arithmetic(inputs, _trees(self.formulas), tuple(alternatives))

    def calls(self) -> list[LabCall]:
        return [LabCall(one.function, one.caller, frozenset(one.checks)) for one in self.call]

    def unknown_check(self, known: Collection[str]) -> str:
        """Return a check that is in the table but not in the rubric, or ""."""
        others = [*(one.not_for for one in self.alternative), *(one.checks for one in self.call)]
        named = (*self.shows, *(name for each in others for name in each))
        return next((one for one in named if one not in known), "")


def _trees(formulas: Mapping[str, str]) -> dict[str, Node]:
    return {name: parse(formula) for name, formula in formulas.items()}


def _refuse_unknown(name: str, formula: str, known: Collection[str]) -> None:
    for used in names(parse(formula)):
        if used not in known:
            raise ValueError(f"formula {name} must use inputs and formulas above it, not {used}")
