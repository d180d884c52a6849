"""Arguments of the tools. Their docstrings and descriptions are the documentation that an agent reads."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

Line = Annotated[str, Field(min_length=1, max_length=4096, pattern=r"^[^\x00-\x1f\x7f]+$")]
"""A path or a name, without control characters."""
Name = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]+$")]
Seconds = Annotated[float, Field(allow_inf_nan=False)]
_FIRMWARE = "An ELF, HEX or BIN file, or lab3, template (in Python), solution, template-arm (in C)."
_SCENARIO = "Name of a shipped scenario, such as stairs or desk (see the guide scenarios.md), or a TOML file."
_SEED = "Random seed: selects the board's offsets and noise."
_WIRING = "lab3 (sensors on I2C) or fcu001v1 (on SPI). Default: the firmware's."


class Arguments(BaseModel):
    """Base class: no other arguments, and only finite numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Build(Arguments):
    """Build lab3.elf in a project of `fcu new`, as `fcu build` does; return the compiler's errors and warnings."""

    folder: Line = Field(description="Folder with main.c, Makefile and support/.")


class Check(Arguments):
    """Judge a program exercise by exercise, as `fcu check` does. A project's folder is built first.

    The result has points, and for each unsolved exercise the failed checks (expected, seen, source line, hint) and
    explanations with function and line. Takes up to a minute.
    """

    target: Line = Field(description="Folder of a project, or an ELF, HEX or BIN file.")
    exercises: list[Name] = Field(
        [], max_length=20, description='Only these exercises, such as ["2"]. Default: all.'
    )
    seed: int = Field(0, ge=0, le=2**31, description="Random seed: selects the board and its motions.")
    hints: int = Field(0, ge=0, le=9, description="Number of further, more explicit hints for each failure.")


class Run(Arguments):
    """Run a firmware on a new board with a scenario, as `fcu run --speed max` does, and judge its output.

    The result has the verdict, failed expectations, diagnoses of the firmware, and the terminal's text.
    """

    firmware: Line | None = Field(
        None, description=f"{_FIRMWARE} Default: the scenario's firmware, else lab3."
    )
    scenario: Line | None = Field(None, description=_SCENARIO)
    duration: Name | None = Field(
        None, description="Virtual time, such as 10s or 500ms. Default: the scenario's, else 5s."
    )
    wiring: Name | None = Field(None, description=_WIRING)
    seed: int | None = Field(None, ge=0, le=2**31, description=_SEED)
    ideal: bool = Field(False, description="Sensors without noise, offset or scale error.")


class ReadText(Arguments):
    """Read the rest of a text that was cut, or a guide. A result with a cut text has the call in its key `rest`.

    Guides have names such as student.md and scenarios.md; llms.txt lists them.
    """

    name: Name = Field(description="Name of a text, from the key rest of a result, or of a guide.")
    first_line: int = Field(1, ge=1, le=10**7, description="First line to return, counted from 1.")


class StartBoard(Arguments):
    """Switch on a live board, which replaces the previous one. Its time passes only in run_board, expect and transfers.

    The result of this and of the other board tools has the virtual time, the LEDs and the state.
    """

    firmware: Line | None = Field(
        None, description=f"{_FIRMWARE} Default: the scenario's firmware, else lab3."
    )
    scenario: Line | None = Field(
        None, description=f"{_SCENARIO} The scenario then moves the board, and act cannot move it."
    )
    wiring: Name | None = Field(None, description=_WIRING)
    seed: int | None = Field(None, ge=0, le=2**31, description=_SEED)
    ideal: bool = Field(False, description="Sensors without noise, offset or scale error.")


class Act(Arguments):
    """Start one action of a scenario's timeline now on the live board: a motion, a button, typed text or a fault.

    Examples: {"do": "rotate_to", "roll_deg": 30, "for": "1s"}; {"do": "set_attitude", "pitch_deg": 85};
    {"do": "lift", "metres": 2, "for": "2s"}; {"do": "figure_eight", "turns": 2, "for": "12s", "by": "hand"};
    {"do": "press_button", "pin": "PA0"}; {"do": "send", "text": "x"};
    {"do": "inject_fault", "kind": "absent", "address": "LIS2MDL", "for": "1s"}. The guide scenarios.md lists all.
    No time passes: call run_board afterwards.
    """

    entry: dict[str, Any] = Field(
        description="The timeline entry of the action, with the key do and without the key at."
    )


class RunBoard(Arguments):
    """Run the live board for some virtual time, and return the text that it prints meanwhile."""

    seconds: Seconds = Field(ge=0, le=3600, description="Virtual time to run; 0 only returns the state.")


class Expect(Arguments):
    """Run the live board until it prints a text, at most for some virtual time.

    The search begins at the end of the previous output, or at the byte position `since`.
    """

    text: Annotated[str, Field(min_length=1, max_length=1000)] = Field(
        description="Exact text to find in the output; not a pattern."
    )
    timeout_s: Seconds = Field(10.0, ge=0, le=3600, description="Virtual time after which the search ends.")
    since: int | None = Field(
        None, ge=0, le=2**60, description="Byte position in the output; 0 searches all output."
    )


class Terminal(Arguments):
    """Read the output of the live board from a byte position. No time passes."""

    since: int = Field(0, ge=0, le=2**60, description="Byte position in the output, from an earlier result.")


class Registers(Arguments):
    """Read registers of a sensor or a peripheral of the live board, decoded into fields, without side effects.

    With `register`, the result also has the meaning of the register and of each field. No time passes.
    """

    part: Name = Field(
        description="LSM6DSL, LIS2MDL, LPS22HB, or a peripheral such as RCC or GPIOB; an unknown name lists all."
    )
    register_name: Name | None = Field(
        None,
        alias="register",
        description="Only this register, such as CTRL1_XL, with meanings. Default: all.",
    )
    first: int = Field(0, ge=0, le=10_000, description="Number of registers to skip, to read the next page.")


class Variables(Arguments):
    """Read global C variables of the live board's firmware as numbers. Without names, list the variables."""

    names: list[Name] = Field(
        [], max_length=50, description='Variables or members, such as ["pitch", "acc.AXIS_X"].'
    )
    first: int = Field(0, ge=0, le=10**6, description="Number of variables to skip in the list.")


class Transfers(Arguments):
    """Read the bus transfers of the live board, with register names and decoded samples.

    With `run_s` the board runs for this virtual time, and the transfers in this time are recorded. With 0, the
    result has only the latest transfers.
    """

    run_s: Seconds = Field(0.0, ge=0, le=10, description="Virtual time to run and record, such as 0.01.")


class Explain(Arguments):
    """Explain the problems of a firmware, or one wrong printed number.

    Problems are crashes, hangs, wrong settings, and numbers that differ from the true values of the live board. For a
    number, the lab's formulas are compared with the values that the firmware computes: the result names the source
    line whose formula differs. Without `firmware`, the live board's firmware is explained.
    """

    number: Name | None = Field(
        None,
        description="Printed number, such as Altitude, Pitch, ACC.x. Default: problems of the live board.",
    )
    firmware: Line | None = Field(
        None, description="ELF file that prints the number. Default: the live board's."
    )
