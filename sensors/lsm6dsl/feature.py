"""A function of the LSM6DSL beyond plain measuring (FIFO, event detection, sensor hub ...).

Each function is a file of its own and joins the model as one entry of its list of features. A feature decodes
its registers in ``configure`` and keeps what it decoded; ``catch_up`` then works through everything that has
become due, sample by sample, under those settings. The model calls ``catch_up`` before any register that a
feature declares is written, and a feature calls ``chip.catch_up`` itself before registers that show its
results are read. A feature that is off is not ``active`` and is never called: it costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from sensors.lsm6dsl.den_gate import Gates
from sensors.lsm6dsl.signals import Signals
from sensors.pin import Pin
from sensors.register import Register
from sensors.register_file import RegisterFile
from sensors.sampling import SampleStream


@dataclass(frozen=True)
class Chip:
    """What a feature works with.

    ``registers``: the main bank; ``banks``: the embedded ones by their FUNC_CFG_ACCESS value; ``xl``, ``g``,
    ``temperature``: the sample streams, little-endian int16 words as in the output registers with BLE = 0;
    ``signals``: what functions raise for each other, for the pins and for the FIFO's trigger;
    ``gates``: what data enable lets through; ``catch_up(now_ps)``: let every active feature do what is due;
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
