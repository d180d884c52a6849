"""The LSM6DSL's internal signals: what its functions raise, and what pins and the FIFO's trigger listen to.

A function sets its signal with the time at which it happened; who needs it (pin routing, FIFO trigger)
listens. Names are those of the routing registers without their pin: ``DRDY_XL``, ``FTH``, ``WU``, ``6D`` ...
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias, get_args

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
SIGNALS: tuple[SignalName, ...] = get_args(SignalName)

Listener: TypeAlias = Callable[[bool, int], None]
"""``listener(on, at_ps)``: the signal became true or false at ``at_ps``."""


class Signals:
    """The level of every signal, and who listens to its changes."""

    def __init__(self) -> None:
        self._on: dict[SignalName, bool] = dict.fromkeys(SIGNALS, False)
        self._listeners: dict[SignalName, list[Listener]] = {name: [] for name in SIGNALS}

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
