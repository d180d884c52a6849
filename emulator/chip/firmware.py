"""Compiled firmware on the virtual board, within limits.

Decision: limits on the firmware's actions (work, instructions, bytes, resets) take effect at the
same instruction on every machine. The limit on wall time is a last resort, because verdicts must
not depend on the machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.boards.description import BoardSignals
from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.chip.chip import Chip
from fcu_emulator.emulator.chip.cpu.core import RESETS_KEPT, Core, CoreSettings
from fcu_emulator.emulator.chip.cpu.exceptions import bits
from fcu_emulator.emulator.chip.cpu.fault_log import FaultLog
from fcu_emulator.emulator.chip.cpu.work import costliest
from fcu_emulator.emulator.chip.diagnosis import Diagnosis, diagnose, findings
from fcu_emulator.emulator.chip.diagnosis.hang import exception_name
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE
from fcu_emulator.emulator.chip.peripherals.flash import SECTORS
from fcu_emulator.emulator.chip.peripherals.tim import Timer
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, Clock
from fcu_emulator.emulator.errors import InputError, LimitError, SymbolError
from fcu_emulator.emulator.trace import LARGEST_FILE

if TYPE_CHECKING:  # imported later, so that runs start sooner
    from fcu_emulator.emulator.chip.calls import Caller


class ArmFirmware:
    """A firmware image and the chip that executes it."""

    def __init__(
        self, signals: BoardSignals, image: FirmwareImage, settings: CoreSettings | None = None
    ) -> None:
        self.image = image
        segments = [(segment.address, segment.data) for segment in image.segments]
        self.chip = Chip(signals, segments, settings or CoreSettings())
        self.signals = signals
        self.faults = FaultLog(self.chip.core)
        self.limits = Limits()
        """Limits of the run, which may be set at any time."""
        self._run = LimitedRun(self.chip.core, signals.clock, signals.uart)

    @property
    def core(self) -> Core:
        """The Cortex-M4 with its peripherals."""
        return self.chip.core

    @property
    def timer(self) -> Timer:
        return self.chip.timers[self.signals.board.timer.peripheral]

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``. Raises LimitError."""
        self._run.run_until_ps(at_ps, self.limits)

    def supply_current_ua(self) -> float:
        """Return the chip's typical supply current in its present mode."""
        return self.chip.low_power.supply_current_ua()

    def diagnosis(self) -> Diagnosis | None:
        """Return the worst problem at the present time, or None."""
        return diagnose(self)

    def diagnosis_text(self) -> str:
        """Return the worst problem as text, or ""."""
        return str(self.diagnosis() or "")

    def findings(self) -> list[Diagnosis]:
        """Return all problems, the worst first."""
        return list(findings(self))

    def handles(self, peripheral: str) -> bool:
        """Return whether a peripheral's interrupt ("TIM9") is active."""
        return any(peripheral in name for name in self.handled())

    def handled(self) -> list[str]:
        """Return the active exceptions, such as "HardFault" or "TIM1_BRK_TIM9"."""
        return [exception_name(number) for number in bits(self.chip.core.active)]

    def variable(self, name: str) -> Any:
        """Return a variable's value. Raises SymbolError for an unknown variable."""
        if self.image.symbols is None:
            problem = f"{self.image.path} must have symbols for the variable {name!r}"
            raise SymbolError(problem, kind="no_symbols")
        return self.image.symbols.read_variable(name, self._memory)

    def set_variable(self, name: str, value: Any) -> None:
        """Set a variable. Raises SymbolError or InputError."""
        from fcu_emulator.emulator.chip.calls import set_variable

        set_variable(self.image, name, value, self._memory, self._store)

    def flash_contents(self) -> bytes:
        """Return all bytes of the flash."""
        return bytes(self.chip.core.flash)

    def load_flash(self, contents: bytes) -> None:
        """Before a run, restore the sectors that the firmware's file does not use. Raises InputError."""
        if len(contents) != FLASH_SIZE:
            raise InputError(f"contents of the flash must have {FLASH_SIZE} bytes, not {len(contents)}")
        used = [(segment.address - FLASH, len(segment.data)) for segment in self.image.segments]
        for sector in SECTORS:
            if not any(begin < sector.stop and begin + size > sector.start for begin, size in used):
                self.chip.core.flash[sector.start : sector.stop] = contents[sector.start : sector.stop]

    def caller(self, restoring: Callable[[], AbstractContextManager[object]]) -> Caller:
        from fcu_emulator.emulator.chip.calls import Caller

        return Caller(self.chip.core, self.image, self.run_until_ps, restoring)

    def _store(self, address: int, raw: bytes) -> None:
        content = self.chip.core.memory(address, len(raw))
        if content is None:
            raise SymbolError(f"{len(raw)} bytes at 0x{address:08X} are not in RAM", kind="outside_memory")
        content[:] = raw

    def _memory(self, address: int, size: int) -> bytes:
        content = self.chip.core.memory(address, size)
        if content is None:
            problem = f"{size} bytes at 0x{address:08X} are neither in flash nor in RAM"
            raise SymbolError(problem, kind="outside_memory")
        return bytes(content)


# -- limits of a run ----------------------------------------------------------------------------------------


WORK_PER_S = 400_000_000
"""The work of about one second of processor time."""


@dataclass(frozen=True)
class Limits:
    """Limits, counted since power-on. A limit of 0 or less raises InputError."""

    instructions: int = 10**13
    """Executed and skipped instructions: 43 hours of virtual time at 84 MHz."""
    terminal_bytes: int = 64 << 20
    """Printed bytes: an hour and a half of output at 115200 baud."""
    resets_per_s: int = 1_000
    """Resets in each second of virtual time. The shortest watchdog period is 0.1 ms."""
    wall_s: float = 3600.0
    """Wall time in which this board runs. Waiting for real time does not count."""
    trace_bytes: int = LARGEST_FILE
    """Maximum size of a trace file in bytes."""
    work_per_s: int = WORK_PER_S
    """Work for each second of virtual time since power-on, and for one second more. The unit is the work of one
    executed instruction.
    """

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0:
                raise InputError(f"limit {field.name} must be above 0, not {value!r}", kind="out_of_range")
        if self.resets_per_s >= RESETS_KEPT:
            raise InputError(
                f"limit resets_per_s must be below {RESETS_KEPT}, not {self.resets_per_s}",
                kind="out_of_range",
            )

    def work_until(self, at_ps: int) -> int:
        return min(self.work_per_s * (at_ps + PS_PER_S) // PS_PER_S, _MAX_WORK)

    def check_printed(self, count: int) -> None:
        if count > self.terminal_bytes:
            raise LimitError("terminal_bytes", f"it has printed more than {self.terminal_bytes} bytes")

    def check_wall(self, wall_s: float) -> None:
        if wall_s > self.wall_s:
            raise LimitError("wall_s", f"it has run for more than {self.wall_s:g} s of wall time")


def parse_limits(settings: Iterable[str]) -> Limits:
    """Return limits from settings ``name=number``. Raises InputError."""
    types = {name: type(usual) for name, usual in asdict(Limits()).items()}
    chosen: dict[str, Any] = {}
    for setting in settings:
        name, _, number = setting.partition("=")
        if name not in types:
            raise InputError(
                f"unknown limit {setting}; known: {', '.join(types)}; for example wall_s=60",
                kind="unknown_limit",
            )
        try:
            chosen[name] = types[name](number)
        except ValueError:
            raise InputError(
                f"limit {name} must be a number, such as {name}=1000, not {setting}", kind="not_a_number"
            ) from None
    return Limits(**chosen)


_CHECK_INTERVAL_PS = 10 * PS_PER_MS
_MAX_WORK = (1 << 63) - 1


class LimitedRun:
    """Runs a core within limits."""

    def __init__(
        self, core: Core, clock: Clock, uart: Uart, wall_clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._core = core
        self._clock = clock
        self._uart = uart
        self._wall_clock_s = wall_clock_s
        self._wall_s = 0.0

    def run_until_ps(self, at_ps: int, limits: Limits) -> None:
        """Run up to and including ``at_ps``, or until a debugger halts the core. Raises LimitError."""
        clock = self._clock
        while True:
            stop_ps = min(at_ps, clock.now_ps + _CHECK_INTERVAL_PS)
            self._core.work_limit = limits.work_until(stop_ps)
            began_s = self._wall_clock_s()
            self._core.run_until_ps(stop_ps)
            self._wall_s += self._wall_clock_s() - began_s
            self._check(limits, stop_ps)
            if stop_ps == at_ps or clock.now_ps < stop_ps:
                return

    def _check(self, limits: Limits, at_ps: int) -> None:
        if self._core.work > limits.work_until(at_ps):
            time_s = f"{self._clock.now_ps / PS_PER_S:.3g} s of virtual time"
            limit = f"work_per_s is {limits.work_per_s:,}"
            raise LimitError(
                "work_per_s", f"too much work for the emulator: {costliest(self._core)} in {time_s} ({limit})"
            )
        if self._core.retired > limits.instructions:
            raise LimitError("instructions", f"it has executed more than {limits.instructions} instructions")
        limits.check_printed(self._uart.received_count())
        limits.check_wall(self._wall_s)
        resets = self._core.resets
        if len(resets) > limits.resets_per_s:
            last_ps, reason = resets[-1]
            if last_ps - resets[-1 - limits.resets_per_s][0] <= PS_PER_S:
                problem = f"it was reset more than {limits.resets_per_s} times in a second, last by {reason}"
                raise LimitError("resets_per_s", problem)
