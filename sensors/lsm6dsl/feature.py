"""A function of the LSM6DSL beyond plain measuring (FIFO, events, sensor hub ...), and what it works with.

Each function is a file of its own and joins the model as one entry of its list of features. A feature decodes
its registers in ``configure`` and keeps what it decoded; ``catch_up`` then works through everything that has
become due, sample by sample, under those settings. The model calls ``catch_up`` before any register that a
feature declares is written, and a feature calls ``chip.catch_up`` itself before registers that show its
results are read. A feature that is off is not ``active`` and is never called: it costs nothing.

Functions raise signals for each other, for the pins and for the FIFO's trigger. A function sets its signal
with the time at which it happened; who needs it (pin routing, FIFO trigger) listens. Names are those of the
routing registers without their pin: ``DRDY_XL``, ``FTH``, ``WU``, ``6D`` ...
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
    """The level of every signal, and who listens to its changes."""

    def __init__(self) -> None:
        self._on: dict[SignalName, bool] = dict.fromkeys(SIGNAL_NAMES, False)
        self._listeners: dict[SignalName, list[Listener]] = {name: [] for name in SIGNAL_NAMES}

    def __getitem__(self, name: SignalName) -> bool:
        return self._on[name]

    def listen(self, name: SignalName, listener: Listener) -> None:
        """Call ``listener`` at every change of a signal."""
        self._listeners[name].append(listener)

    def set(self, name: SignalName, on: bool, at_ps: int) -> None:
        """A signal is true or false as of ``at_ps``; listeners hear of changes only."""
        if self._on[name] != on:
            self._on[name] = on
            for listener in self._listeners[name]:
                listener(on, at_ps)


class Gates:
    """What data enable lets through: samples of a sensor, and anything to the FIFO."""

    def __init__(self) -> None:
        self.fifo_open = True
        self._instead: dict[SampleStream, SampleStream] = {}

    def show(self, stream: SampleStream, instead: SampleStream | None) -> None:
        """``stream`` is shown through another one from now on, or as it is."""
        self._instead.pop(stream, None)
        if instead is not None:
            self._instead[stream] = instead

    def shown(self, stream: SampleStream) -> SampleStream:
        """What output registers, data-ready and FIFO see of a sensor's stream."""
        return self._instead.get(stream, stream)


@dataclass(frozen=True)
class FeatureContext:
    """What a feature works with.

    ``registers``: the main bank; ``banks``: the embedded ones by their FUNC_CFG_ACCESS value; ``xl``, ``g``,
    ``temperature``: the sample streams, little-endian int16 words as in the output registers with BLE = 0;
    ``signals``: what functions raise for each other, for the pins and for the FIFO's trigger;
    ``gates``: what data enable lets through; ``rate_factor``: the part's true rates over the nominal ones;
    ``catch_up(now_ps)``: let every active feature do what is due;
    ``note(now_ps, kind, text)``: the trace.
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
        """The rate of a sensor's stream as the registers say it; 0 when stopped."""
        return stream.rate_hz / self.rate_factor

    def note(self, now_ps: int, kind: str, text: str) -> None:
        """A trace event of the part."""
        self.registers.note(now_ps, kind, text)


class Feature(Protocol):
    """One function of the chip."""

    active: bool
    CONFIGURATION: tuple[type[Register], ...]
    """Registers of the main bank whose writing may change what the feature does."""

    def configure(self, now_ps: int) -> None:
        """The registers may have changed: decode them; everything before ``now_ps`` has been caught up."""

    def catch_up(self, now_ps: int) -> None:
        """Work through all that has become due until ``now_ps``; only called while ``active``."""

    def reset(self, now_ps: int) -> None:
        """SW_RESET: forget everything; ``configure`` follows."""

    def next_event_ps(self) -> int:
        """When a pin may change next because of this feature (``NEVER_PS`` if none can)."""
        ...


# -- settings that cannot work ------------------------------------------------------------------------------


class Violations:
    """Remembers which are present, so that the next write to another register does not repeat the note."""

    def __init__(self, chip: FeatureContext) -> None:
        self._chip = chip
        self._present: set[str] = set()

    def report(self, found: Mapping[str, bool], now_ps: int) -> None:
        """``found``: each violation's text, and whether it is present."""
        for text, present in found.items():
            if present and text not in self._present:
                self._chip.note(now_ps, "forbidden", text)
        self._present = {text for text, present in found.items() if present}
