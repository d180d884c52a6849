"""Errors that this package raises on purpose, by the source of the fault.

::

    FcuError
    ├── InputError                 user input           (exit code 2)
    │   ├── ScenarioError          scenario file
    │   ├── RubricError            rubric
    │   ├── RecordingError         CSV recording
    │   ├── FirmwareFileError      firmware file
    │   ├── SymbolError            C name, also a KeyError
    │   └── LinkError              serial link or output file
    ├── ExpectationError           unmet expectation    (exit code 1)
    ├── FirmwareError              failed firmware      (exit code 3)
    │   ├── LimitError             exceeded limit
    │   └── CallError              failed function call
    ├── NotJudgedError             no verdict           (exit code 4)
    │   └── OutputError            lost output
    └── I2CError                   failed transfer
        ├── I2CNackError           no acknowledge
        ├── I2CBusError            misplaced start or stop (BERR)
        └── I2CStuckError          line held low

I2C errors are raised only for transfers of Python code through ``board.i2c2``. The trace records
bus errors of the firmware. Any other exception is a bug of this package.
"""

from __future__ import annotations

import re

from fcu_emulator.emulator.text import visible

_LONGEST_PROBLEM = 400  # characters; a list of all known keys can be longer


def _shortened(problem: str) -> str:
    return problem if len(problem) <= _LONGEST_PROBLEM else f"{problem[: _LONGEST_PROBLEM - 3]}..."


def _kind_of(error: type[FcuError]) -> str:
    return re.sub(r"(?<!^)(?=[A-Z][a-z])", "_", error.__name__.removesuffix("Error")).lower() or "error"


class FcuError(Exception):
    """Base class of this package's intended errors.

    The text has no control characters. The text is one line, unless ``has_lines`` is set. ``kind``
    identifies the problem ("unknown_key"). The default kind is the class name ("scenario").
    """

    has_lines = False

    def __init__(self, *arguments: object, kind: str = "") -> None:
        self.kind = kind or _kind_of(type(self))
        super().__init__(*arguments)

    def __str__(self) -> str:
        return visible(Exception.__str__(self), lines=self.has_lines)


def failure_text(error: Exception) -> str:
    """Return the message to the user for an ``error`` that ended one command, not the run."""
    if isinstance(error, FcuError):
        return str(error)
    if isinstance(error, MemoryError):
        return "cannot continue: not enough memory"
    if isinstance(error, OSError):
        return f"cannot continue: {error.strerror or error}"
    what = f"{type(error).__name__}: {str(error)[:200]}"
    return f"cannot continue: a bug in fcu-emulator ({what}); please report it"


class InputError(FcuError):
    """The user's input cannot be used. The message contains problem, place and correct form."""


class ScenarioError(InputError):
    """A scenario file is wrong at ``key``, a path such as ``timeline[2].for``."""

    def __init__(self, file: str, key: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.key = key
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {key}: {problem}" if key else f"{file}: {problem}", kind=kind)


class RubricError(InputError):
    """A rubric is wrong at ``key``, a path such as ``exercise[1].check[0].points``."""

    def __init__(self, file: str, key: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.key = key
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {key}: {problem}" if key else f"{file}: {problem}", kind=kind)


class RecordingError(InputError):
    """A CSV recording is wrong at ``line``, counted from 1 (0: whole file)."""

    def __init__(self, file: str, line: int, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.line = line
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}:{line}: {problem}" if line else f"{file}: {problem}", kind=kind)


class FirmwareFileError(InputError):
    """This board cannot run the firmware file."""

    def __init__(self, file: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {problem}", kind=kind)


class LinkError(InputError):
    """A serial link or an output file cannot be opened."""


class SymbolError(InputError, KeyError):
    """A C name is not in the firmware, or its type is unknown."""


class ExpectationError(FcuError):
    """The firmware did not meet an expectation.

    The message contains ``lines`` (last terminal lines) and ``diagnosis`` (the firmware's
    problems).
    """

    has_lines = True

    def __init__(self, problem: str, lines: tuple[str, ...] = (), diagnosis: str = "") -> None:
        self.lines = lines
        self.diagnosis = diagnosis
        shown = "".join(f"\n  {line}" for line in lines)
        told = "".join(f"\n  {line}" for line in diagnosis.splitlines())
        terminal = f"\nlast lines of the terminal:{shown}" if lines else ""
        super().__init__(f"{problem}{terminal}" + (f"\nproblems of the firmware:{told}" if told else ""))


class FirmwareError(FcuError):
    """The firmware failed. ``__cause__`` is its exception."""

    has_lines = True


class LimitError(FirmwareError):
    """Firmware reached ``limit``, one of :class:`fcu_emulator.emulator.chip.firmware.Limits`."""

    def __init__(self, limit: str, problem: str) -> None:
        self.limit = limit
        super().__init__(f"the firmware was stopped: {problem}; to allow more: --limit {limit}=NUMBER")


class CallError(FirmwareError):
    """A called function of the firmware failed or did not return."""


class NotJudgedError(FcuError):
    """The run ended early or failed outside the firmware, so it has no verdict."""


class OutputError(NotJudgedError):
    """Output was lost: full disk, closed reader, or oversized file."""


class I2CError(FcuError):
    """A transfer failed. ``address`` is its 7-bit target."""

    def __init__(self, address: int, problem: str) -> None:
        self.address = address
        super().__init__(f"I2C 0x{address:02X}: {problem}")


class I2CNackError(I2CError):
    """Byte ``byte_index`` was not acknowledged. The address byte has index 0."""

    def __init__(self, address: int, byte_index: int) -> None:
        self.byte_index = byte_index
        where = "its address" if byte_index == 0 else f"data byte {byte_index}"
        super().__init__(address, f"no acknowledge of {where}")


class I2CBusError(I2CError):
    """A start or stop condition was misplaced (BERR of the STM32)."""


class I2CStuckError(I2CError):
    """SDA or SCL is held low and prevents a start."""
