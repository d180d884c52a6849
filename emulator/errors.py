"""Every error this package raises on purpose, grouped by where the fault lies.

::

    FcuError
    ├── InputError                 what the user gave is wrong            (exit code 2)
    │   ├── ScenarioError          a scenario file: names file and key path
    │   ├── RubricError            a rubric: names file and key path
    │   ├── RecordingError         a CSV recording: names file and line
    │   ├── FirmwareFileError      an ELF, HEX or BIN that is not firmware for this board: names the file
    │   └── LinkError              a serial link or output file this machine cannot give
    ├── ExpectationError           the firmware did not do what was expected (exit code 1)
    ├── FirmwareError              the firmware itself failed             (exit code 3)
    │   ├── LimitError             it took more than a run may
    │   └── CallError              a function that was called did not return
    ├── NotJudgedError             nothing can be said about the firmware (exit code 4)
    │   └── OutputError            what was printed or recorded could not be delivered
    └── I2CError                   a transfer on the simulated bus failed
        ├── I2CNackError           nobody acknowledged: absent device, or NACK at a byte
        ├── I2CBusError            misplaced start or stop (BERR)
        └── I2CStuckError          a line is held low, the bus stays busy

What a guest does wrong (a NACK that firmware provokes, an overrun, a write to a read-only register) is no
exception inside a run: it goes into the trace, where a grader sees it. The I2C errors reach Python only when
Python itself is the bus master, through ``board.i2c2``. An error outside this tree is a bug of ours.
"""

from __future__ import annotations

import re

from fcu_emulator.emulator.text import visible

_LONGEST_PROBLEM = 400  # characters; a list of all keys that are known can be longer


def _shortened(problem: str) -> str:
    return problem if len(problem) <= _LONGEST_PROBLEM else f"{problem[: _LONGEST_PROBLEM - 3]}..."


def _kind_of(error: type[FcuError]) -> str:
    return re.sub(r"(?<!^)(?=[A-Z][a-z])", "_", error.__name__.removesuffix("Error")).lower() or "error"


class FcuError(Exception):
    """Base of everything this package raises on purpose.

    Its text is one line without control characters, whatever the names and values in it are. With
    ``has_lines`` it may have several lines, of a terminal, a compiler or a diagnosis.

    ``kind`` says in one word what is wrong ("unknown_key"). It stays when the text is improved; without a kind of its
    own an error has that of its class ("scenario").
    """

    has_lines = False

    def __init__(self, *arguments: object, kind: str = "") -> None:
        self.kind = kind or _kind_of(type(self))
        super().__init__(*arguments)

    def __str__(self) -> str:
        return visible(super().__str__(), lines=self.has_lines)


def failure_text(error: Exception) -> str:
    """Return what a user is told when ``error`` ended one command and the program continues."""
    if isinstance(error, FcuError):
        return str(error)
    if isinstance(error, MemoryError):
        return "cannot do this: there is not enough memory"
    if isinstance(error, OSError):
        return f"cannot do this: {error.strerror or error}"
    what = f"{type(error).__name__}: {str(error)[:200]}"
    return f"cannot do this: a bug in fcu-emulator ({what}); please report it"


class InputError(FcuError):
    """Something the user gave cannot be used; the message says what, where and what would be right."""


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
    """A CSV recording is wrong at ``line`` (counted from 1, the header's line; 0 means the whole file)."""

    def __init__(self, file: str, line: int, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.line = line
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}:{line}: {problem}" if line else f"{file}: {problem}", kind=kind)


class FirmwareFileError(InputError):
    """A firmware file cannot be run on this board; ``problem`` says what is wrong and what would be right."""

    def __init__(self, file: str, problem: str, *, kind: str = "") -> None:
        self.file = file
        self.problem = problem = _shortened(problem)
        super().__init__(f"{file}: {problem}", kind=kind)


class LinkError(InputError):
    """A serial link or an output file cannot be opened on this machine."""


class ExpectationError(FcuError):
    """Something expected of the firmware did not happen.

    ``lines``: the last lines of the terminal; ``diagnosis``: what is seen to be wrong with the firmware, ""
    if nothing is. Both are part of the message.
    """

    has_lines = True

    def __init__(self, problem: str, lines: tuple[str, ...] = (), diagnosis: str = "") -> None:
        self.lines = lines
        self.diagnosis = diagnosis
        shown = "".join(f"\n  {line}" for line in lines)
        told = "".join(f"\n  {line}" for line in diagnosis.splitlines())
        terminal = f"\nthe terminal's last lines:{shown}" if lines else ""
        super().__init__(
            f"{problem}{terminal}" + (f"\nwhat is wrong with the firmware:{told}" if told else "")
        )


class FirmwareError(FcuError):
    """The firmware under test failed; ``__cause__`` is its own exception."""

    has_lines = True


class LimitError(FirmwareError):
    """Firmware was stopped at ``limit``, a field of :class:`fcu_emulator.emulator.chip.firmware.Limits`."""

    def __init__(self, limit: str, problem: str) -> None:
        self.limit = limit
        super().__init__(f"the firmware was stopped: {problem}; to allow more: --limit {limit}=NUMBER")


class CallError(FirmwareError):
    """A function of the firmware that was called has failed, or has not returned."""


class NotJudgedError(FcuError):
    """The run says nothing about the firmware: something around it failed, or ended it too soon."""


class OutputError(NotJudgedError):
    """Output was lost: a full disk, a reader that has gone, a file that has become too large."""


class I2CError(FcuError):
    """A transfer failed; ``address`` is the 7-bit address it was for."""

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
    """A misplaced start or stop was seen (the BERR flag of the STM32's I2C)."""


class I2CStuckError(I2CError):
    """SDA or SCL is held low, so that no transfer can start."""
