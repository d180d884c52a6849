"""Firmware built for the chip, on the virtual board: the back end that executes ARM code.

::

    board = Board(firmware="build/lab3.elf")
    board.run_for(3)
    board.variable("pitch")              # a C variable, by the ELF's symbols and debug information
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from emulator.boards.description import BoardSignals
from emulator.chip.chip import Chip
from emulator.chip.cpu.core import CoreSettings
from emulator.chip.cpu.exceptions import bits
from emulator.chip.cpu.fault_log import FaultLog
from emulator.chip.diagnosis import Diagnosis, diagnose, findings
from emulator.chip.diagnosis.hang import exception_name
from emulator.chip.image import FirmwareImage
from emulator.chip.limits import LimitedRun, Limits
from emulator.chip.peripherals.tim import Timer

if TYPE_CHECKING:  # imported when a function is called, with what reads debug information: runs start sooner
    from emulator.chip.calls import Caller


class ArmFirmware:
    """A firmware image in flash, and the chip that executes it from power-on.

    ``chip`` and ``image`` are there for debuggers and diagnoses. One of the back ends of
    :mod:`emulator.board.firmware`.
    """

    def __init__(
        self, signals: BoardSignals, image: FirmwareImage, settings: CoreSettings | None = None
    ) -> None:
        self.image = image
        segments = [(segment.address, segment.data) for segment in image.segments]
        self.chip = Chip(signals, segments, settings or CoreSettings())
        self.signals = signals
        self.faults = FaultLog(self.chip.core)
        self.limits = Limits()
        """What a run may take; may be set at any time."""
        self._run = LimitedRun(self.chip.core, signals.clock, signals.uart)

    @property
    def timer(self) -> Timer:
        """The timer of the callback."""
        return self.chip.timers[self.signals.board.timer.block]

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``. Raises LimitError when the firmware takes too much."""
        self._run.run_until_ps(at_ps, self.limits)

    def diagnosis(self) -> Diagnosis | None:
        """What keeps the firmware from working, as far as can be told now; None if it does work."""
        return diagnose(self)

    def handles(self, block: str) -> bool:
        """Whether an interrupt of a block ("TIM9") is being handled now."""
        return any(block in name for name in self.handled())

    def handled(self) -> list[str]:
        """The exceptions being handled now, preempted ones included: "HardFault", "TIM1_BRK_TIM9"."""
        return [exception_name(number) for number in bits(self.chip.core.active)]

    def diagnosis_text(self) -> str:
        """The same as text; "" if nothing is seen to be wrong."""
        return str(self.diagnosis() or "")

    def findings(self) -> list[Diagnosis]:
        """Everything that can be seen to be wrong with the firmware now, the worst first.

        What the world and the sensors say besides: :func:`emulator.analysis.mistakes.explain`.
        """
        return list(findings(self))

    def variable(self, name: str) -> Any:
        """A global variable by its C name, as :meth:`Symbols.read_variable` gives it. Raises KeyError."""
        if self.image.symbols is None:
            raise KeyError(f"{self.image.path} has no symbols, so no variable {name!r}")
        return self.image.symbols.read_variable(name, self._memory)

    def set_variable(self, name: str, value: Any) -> None:
        """Give a global variable a value. Raises KeyError, and InputError for a value that does not fit."""
        from emulator.chip.calls import set_variable

        set_variable(self.image, name, value, self._memory, self._store)

    def caller(self, restoring: Callable[[], AbstractContextManager[object]]) -> Caller:
        """What calls single functions; see :class:`Caller`."""
        from emulator.chip.calls import Caller

        return Caller(self.chip.core, self.image, self.run_until_ps, restoring)

    def _store(self, address: int, raw: bytes) -> None:
        content = self.chip.core.memory(address, len(raw))
        if content is None:
            raise KeyError(f"{len(raw)} bytes at 0x{address:08X} are not in RAM")
        content[:] = raw

    def _memory(self, address: int, size: int) -> bytes:
        content = self.chip.core.memory(address, size)
        if content is None:
            raise KeyError(f"{size} bytes at 0x{address:08X} are neither in flash nor in RAM")
        return bytes(content)
