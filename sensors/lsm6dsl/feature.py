"""Interface of a function of the LSM6DSL beyond plain measuring (FIFO, events, sensor hub ...), and its context.

Each function is a separate file and one entry in the model's list of features. A feature decodes its
registers in ``configure`` and stores the result; ``catch_up`` then processes all due work, sample by sample,
under those settings. The model calls ``catch_up`` before a write to any register that a feature declares. A
feature calls ``chip.catch_up`` itself before a read of registers with its results. A feature that is off is
not ``active`` and is never called: it costs nothing.

Functions exchange signals, also with the pins and the FIFO's trigger. A function sets its signal with the
time of the event; its users (pin routing, FIFO trigger) listen. Names are those of the routing registers
without their pin: ``DRDY_XL``, ``FTH``, ``WU``, ``6D`` ...
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
"""``listener(on, at_ps)``: the signal became true or false at ``at_ps``."""


class Signals:
    """The level of every signal, and the listeners to its changes."""

    def __init__(self) -> None:
        self._on: dict[SignalName, bool] = dict.fromkeys(SIGNAL_NAMES, False)
        self._listeners: dict[SignalName, list[Listener]] = {name: [] for name in SIGNAL_NAMES}

    def __getitem__(self, name: SignalName) -> bool:
        return self._on[name]

    def listen(self, name: SignalName, listener: Listener) -> None:
        """Call ``listener`` at every change of a signal."""
        self._listeners[name].append(listener)

    def set(self, name: SignalName, on: bool, at_ps: int) -> None:
        """Set the level of a signal as of ``at_ps``; listeners are called for changes only."""
        if self._on[name] != on:
            self._on[name] = on
            for listener in self._listeners[name]:
                listener(on, at_ps)


class Gates:
    """The gates of data enable: samples of a sensor, and all writes to the FIFO."""

    def __init__(self) -> None:
        self.fifo_open = True
        self._instead: dict[SampleStream, SampleStream] = {}

    def show(self, stream: SampleStream, instead: SampleStream | None) -> None:
        """Show ``stream`` through ``instead`` from now on; unchanged with None."""
        self._instead.pop(stream, None)
        if instead is not None:
            self._instead[stream] = instead

    def shown(self, stream: SampleStream) -> SampleStream:
        """Return the visible stream of a sensor for output registers, data-ready and FIFO."""
        return self._instead.get(stream, stream)


@dataclass(frozen=True)
class FeatureContext:
    """The environment of a feature.

    ``registers``: the main bank;
    ``banks``: the embedded ones by their FUNC_CFG_ACCESS value;
    ``xl``, ``g``, ``temperature``: the sample streams, little-endian int16 words as in the output registers
    with BLE = 0;
    ``signals``: signals between functions, to the pins and to the FIFO's trigger;
    ``gates``: the gates of data enable;
    ``rate_factor``: the sensor's true rates over the nominal ones; ``catch_up(now_ps)``: let every active
    feature do its due work; ``note(now_ps, kind, text)``: the trace.
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
        """Return the nominal rate of a sensor's stream from the registers; 0 when stopped."""
        return stream.rate_hz / self.rate_factor

    def note(self, now_ps: int, kind: str, text: str) -> None:
        """Write a trace event of the sensor."""
        self.registers.note(now_ps, kind, text)


class Feature(Protocol):
    """One function of the chip."""

    active: bool
    CONFIGURATION: tuple[type[Register], ...]
    """Registers of the main bank whose writes may change the feature."""

    def configure(self, now_ps: int) -> None:
        """Decode the registers, which may have changed; all work before ``now_ps`` is done."""

    def catch_up(self, now_ps: int) -> None:
        """Process all work due until ``now_ps``; only called while ``active``."""

    def reset(self, now_ps: int) -> None:
        """Reset the feature (SW_RESET); ``configure`` follows."""

    def next_event_ps(self) -> int:
        """Return when this feature may change a pin next (``NEVER_PS`` if never)."""
        ...


# -- invalid settings ---------------------------------------------------------------------------------------


class Violations:
    """Memory of the present violations, so that a write to another register does not repeat the note."""

    def __init__(self, chip: FeatureContext) -> None:
        self._chip = chip
        self._present: set[str] = set()

    def report(self, found: Mapping[str, bool], now_ps: int) -> None:
        """Note new violations; ``found``: each violation's text, and whether it is present."""
        for text, present in found.items():
            if present and text not in self._present:
                self._chip.note(now_ps, "forbidden", text)
        self._present = {text for text, present in found.items() if present}
