"""Interface and context of an LSM6DSL function other than plain measuring.

The model calls ``catch_up`` before a write to registers that a feature declares; a feature calls ``chip.catch_up``
before a read of its results. Signals have the routing registers' names: ``DRDY_XL``, ``FTH`` ...
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, Protocol, TypeAlias, get_args

from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import RegisterFile
from fcu_emulator.sensors.sampling import SampleStream

SignalName: TypeAlias = Literal[
    "DRDY_XL",
    "DRDY_G",
    "DRDY_TEMP",
    "BOOT",
    "FTH",
    "FIFO_OVR",
    "FULL_FLAG",
    "SIGN_MOT",
    "STEP_DETECTOR",
    "STEP_COUNT_OV",
    "STEP_DELTA",
    "INACT_STATE",
    "SINGLE_TAP",
    "WU",
    "FF",
    "DOUBLE_TAP",
    "6D",
    "TILT",
    "TIMER",
    "IRON",
    "WRIST_TILT",
    "SENSORHUB",
    "DEN_DRDY",
]
SIGNAL_NAMES: tuple[SignalName, ...] = get_args(SignalName)

Listener: TypeAlias = Callable[[bool, int], None]
"""``listener(on, at_ps)``: the signal changed at ``at_ps``."""


class Signals:
    """Levels of all signals, and listeners to changes."""

    def __init__(self) -> None:
        self._on: dict[SignalName, bool] = dict.fromkeys(SIGNAL_NAMES, False)
        self._listeners: dict[SignalName, list[Listener]] = {name: [] for name in SIGNAL_NAMES}

    def __getitem__(self, name: SignalName) -> bool:
        return self._on[name]

    def listen(self, name: SignalName, listener: Listener) -> None:
        self._listeners[name].append(listener)

    def set(self, name: SignalName, on: bool, at_ps: int) -> None:
        """Set a signal's level; listeners are called for changes only."""
        if self._on[name] != on:
            self._on[name] = on
            for listener in self._listeners[name]:
                listener(on, at_ps)


class Gates:
    """The gates of data enable: one for a sensor's samples, and one for the FIFO."""

    def __init__(self) -> None:
        self.fifo_open = True
        self._instead: dict[SampleStream, SampleStream] = {}

    def show(self, stream: SampleStream, instead: SampleStream | None) -> None:
        """Show ``instead`` in place of ``stream``. None: show ``stream`` itself."""
        self._instead.pop(stream, None)
        if instead is not None:
            self._instead[stream] = instead

    def shown(self, stream: SampleStream) -> SampleStream:
        """Return the visible stream of a sensor."""
        return self._instead.get(stream, stream)


@dataclass(frozen=True)
class FeatureContext:
    """The environment of a feature.

    ``banks``: all banks, keyed by the value of FUNC_CFG_ACCESS; ``xl``, ``g``, ``temperature``: streams of
    little-endian int16 words;
    ``rate_factor``: true rate divided by nominal rate; ``catch_up(now_ps)``: call ``catch_up`` of all active features.
    """

    registers: RegisterFile
    banks: Mapping[int, RegisterFile]
    xl: SampleStream
    g: SampleStream
    temperature: SampleStream
    signals: Signals
    int1: Pin
    int2: Pin
    catch_up: Callable[[int], None]
    gates: Gates = field(default_factory=Gates)
    rate_factor: Fraction = Fraction(1)

    def nominal_hz(self, stream: SampleStream) -> Fraction:
        """Return the nominal rate; 0 when stopped."""
        return stream.rate_hz / self.rate_factor

    def note(self, now_ps: int, what: str, problem: str, text: str, **data: float | str) -> None:
        self.registers.note(now_ps, what, problem, text, **data)


class Feature(Protocol):
    """One function of the chip. While it is not ``active``, only ``configure`` and ``reset`` are called."""

    active: bool
    CONFIGURATION: tuple[type[Register], ...]
    """Registers whose writes may change the feature."""

    def configure(self, now_ps: int) -> None:
        """Decode the registers; all work before ``now_ps`` is done."""

    def catch_up(self, now_ps: int) -> None:
        """Process all work that is due until ``now_ps``."""

    def reset(self, now_ps: int) -> None:
        """Reset the feature (SW_RESET); ``configure`` follows."""

    def next_event_ps(self) -> int:
        """Return when a pin may change next, or ``NEVER_PS``."""
        ...


# -- invalid settings ---------------------------------------------------------------------------------------


class Violations:
    """The present violations. They are stored so that each violation is noted once."""

    def __init__(self, chip: FeatureContext) -> None:
        self._chip = chip
        self._present: set[tuple[str, str]] = set()

    def report(self, found: Mapping[tuple[str, str], bool], now_ps: int) -> None:
        """Report new violations; ``found``: for the name and text of each problem, whether it is present."""
        for violation, present in found.items():
            if present and violation not in self._present:
                self._chip.note(now_ps, "forbidden", *violation)
        self._present = {violation for violation, present in found.items() if present}
