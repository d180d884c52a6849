"""Limits of a run of built firmware. Whoever runs a stranger's file, or an endless loop of their own, gets
the machine back, with one line that says which limit was exceeded.

Virtual time needs no limit of its own: a run ends at the time that it was asked for. The others are looked
at every 10 ms of virtual time, between two instructions, so a run that is far slower than real time (an
access to a register in every instruction, an interrupt storm) is stopped soon after its limit and not at the
end of what was asked for.

Decision: limits on what the firmware does (instructions, bytes, resets) strike at the same instruction on
every machine and are close enough for nearly all; wall time is the last resort, and generous, because a
verdict that depends on the machine is no verdict. The road not taken, a process of its own that is killed
after a while, would also stop an endless loop of ours, but no firmware can cause one: it reaches nothing
but the model.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, fields
from typing import Any

from emulator.buses.uart import Uart
from emulator.chip.cpu.core import RESETS_KEPT, Core
from emulator.errors import InputError, LimitError
from emulator.time.clock import PS_PER_MS, PS_PER_S, Clock
from emulator.trace import LARGEST_FILE

_LOOK_EVERY_PS = 10 * PS_PER_MS


@dataclass(frozen=True)
class Limits:
    """What is allowed since power-on. Raises InputError for a limit that is not above 0."""

    instructions: int = 10**13
    """Retired, those of skipped waiting included: 43 hours of virtual time at 84 MHz."""
    terminal_bytes: int = 64 << 20
    """At 115200 baud an hour and a half without a pause."""
    resets_per_s: int = 1_000
    """In one second of virtual time. The shortest watchdog period is 0.1 ms, a boot prints for 30 ms."""
    wall_s: float = 3600.0
    """Time spent in running this board, waiting for the wall clock not included."""
    trace_bytes: int = LARGEST_FILE
    """Of a trace file."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0:
                raise InputError(f"limit {field.name} is {value!r}; give a number above 0")
        if self.resets_per_s >= RESETS_KEPT:
            raise InputError(f"limit resets_per_s is {self.resets_per_s}; give less than {RESETS_KEPT}")

    def check_printed(self, count: int) -> None:
        """Raises LimitError when ``count`` bytes of text are too many."""
        if count > self.terminal_bytes:
            raise LimitError("terminal_bytes", f"it has printed more than {self.terminal_bytes} bytes")

    def check_wall(self, wall_s: float) -> None:
        """Raises LimitError when a run of ``wall_s`` seconds is too long."""
        if wall_s > self.wall_s:
            raise LimitError("wall_s", f"it has run for more than {self.wall_s:g} s of wall time")


def parse_limits(settings: Iterable[str]) -> Limits:
    """The usual limits with some replaced, each given as ``name=number``. Raises InputError."""
    types = {name: type(usual) for name, usual in asdict(Limits()).items()}
    chosen: dict[str, Any] = {}
    for setting in settings:
        name, _, number = setting.partition("=")
        if name not in types:
            raise InputError(f"limit {setting}: known are {', '.join(types)}, such as wall_s=60")
        try:
            chosen[name] = types[name](number)
        except ValueError:
            raise InputError(f"limit {setting}: give a number, such as {name}=1000") from None
    return Limits(**chosen)


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
        """Run up to and including ``at_ps``, less if a debugger halts the core. Raises LimitError."""
        clock = self._clock
        while True:
            stop_ps = min(at_ps, clock.now_ps + _LOOK_EVERY_PS)
            began_s = self._wall_clock_s()
            self._core.run_until_ps(stop_ps)
            self._wall_s += self._wall_clock_s() - began_s
            self._check(limits)
            if stop_ps == at_ps or clock.now_ps < stop_ps:
                return

    def _check(self, limits: Limits) -> None:
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
