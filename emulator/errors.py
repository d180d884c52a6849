"""All errors that this package raises on purpose, grouped by the source of the fault.

::

    FcuError
    ├── InputError                 wrong user input             (exit code 2)
    │   ├── ScenarioError          a scenario file
    │   ├── RubricError            a rubric
    │   ├── RecordingError         a CSV recording
    │   ├── FirmwareFileError      a file that is not firmware for this board
    │   ├── SymbolError            a C name that cannot be used; also a KeyError
    │   └── LinkError              a serial link or output file
    ├── ExpectationError           an expectation was not met   (exit code 1)
    ├── FirmwareError              the firmware itself failed   (exit code 3)
    │   ├── LimitError             it exceeded a limit
    │   └── CallError              a called function did not return
    ├── NotJudgedError             no verdict                   (exit code 4)
    │   └── OutputError            lost output
    └── I2CError                   a transfer on the bus failed
        ├── I2CNackError           no acknowledge
        ├── I2CBusError            misplaced start or stop (BERR)
        └── I2CStuckError          a line is held low

Bus errors of the firmware are recorded in the trace. I2C errors are raised only if Python code is the bus master,
through ``board.i2c2``. An error outside this tree is a bug of this package.
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
    """Base class of all errors that this package raises on purpose.

    The text is one line without control characters; with ``has_lines`` it may have several lines. ``kind`` is a stable
    identifier of the problem ("unknown_key"), by default derived from the name of the class ("scenario").
    """

    has_lines = False

    def __init__(self, *arguments: object, kind: str = "") -> None:
        self.kind = kind or _kind_of(type(self))
        super().__init__(*arguments)

    def __str__(self) -> str:
        return visible(Exception.__str__(self), lines=self.has_lines)


def failure_text(error: Exception) -> str:
    """Return the message to the user if ``error`` ended one command but not the program."""
    if isinstance(error, FcuError):
        return str(error)
    if isinstance(error, MemoryError):
        return "cannot continue: not enough memory"
    if isinstance(error, OSError):
        return f"cannot continue: {error.strerror or error}"
    what = f"{type(error).__name__}: {str(error)[:200]}"
    return f"cannot continue: a bug in fcu-emulator ({what}); please report it"


class InputError(FcuError):
    """The user's input cannot be used; the message states problem, place and correct form."""


class ScenarioError(InputError):
    """A scenario file is wrong at ``key`` (a dotted path such as ``timeline[2].for``)."""

    def __init__(self, file: str, key: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.key = key
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {key}: {problem}" if key else f"{file}: {problem}", kind=kind)


class RubricError(InputError):
    """A rubric is wrong at ``key`` (a dotted path such as ``exercise[1].check[0].points``)."""

    def __init__(self, file: str, key: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.key = key
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {key}: {problem}" if key else f"{file}: {problem}", kind=kind)


class RecordingError(InputError):
    """A CSV recording is wrong at ``line`` (from 1; 0 means the whole file)."""

    def __init__(self, file: str, line: int, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.line = line
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}:{line}: {problem}" if line else f"{file}: {problem}", kind=kind)


class FirmwareFileError(InputError):
    """A firmware file cannot be run on this board."""

    def __init__(self, file: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {problem}", kind=kind)


class LinkError(InputError):
    """A serial link or an output file cannot be opened on this machine."""


class SymbolError(InputError, KeyError):
    """A variable or function cannot be found in the firmware by its C name, or its type is unknown."""


class ExpectationError(FcuError):
    """An expectation of the firmware was not met.

    ``lines``: the last lines of the terminal; ``diagnosis``: the firmware's problems. Both are part of the
    message.
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
    """The firmware under test failed; ``__cause__`` is the exception of the firmware."""

    has_lines = True


class LimitError(FirmwareError):
    """Firmware was stopped at ``limit``, a field of :class:`fcu_emulator.emulator.chip.firmware.Limits`."""

    def __init__(self, limit: str, problem: str) -> None:
        self.limit = limit
        super().__init__(f"the firmware was stopped: {problem}; to allow more: --limit {limit}=NUMBER")


class CallError(FirmwareError):
    """A called function of the firmware has failed, or has not returned."""


class NotJudgedError(FcuError):
    """The run has no verdict, because of a failure outside the firmware or an early end."""


class OutputError(NotJudgedError):
    """Output was lost: the disk is full, the reader has closed its end, or the file is too large."""


class I2CError(FcuError):
    """A transfer failed; ``address`` is its 7-bit target address."""

    def __init__(self, address: int, problem: str) -> None:
        self.address = address
        super().__init__(f"I2C 0x{address:02X}: {problem}")


class I2CNackError(I2CError):
    """Byte ``byte_index`` was not acknowledged; 0 is the address byte, 1 the first data byte."""

    def __init__(self, address: int, byte_index: int) -> None:
        self.byte_index = byte_index
        where = "its address" if byte_index == 0 else f"data byte {byte_index}"
        super().__init__(address, f"no acknowledge of {where}")


class I2CBusError(I2CError):
    """A start or stop condition was misplaced (the BERR flag of the STM32's I2C)."""


class I2CStuckError(I2CError):
    """SDA or SCL is held low, so that no transfer can start."""
