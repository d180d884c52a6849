"""Data enable: INT2 is an input; its level marks samples, or selects the samples that pass (AN5040 4.8).

* level: the stamped axes' LSB is 1 while DEN is active.
* latched: the LSB is 1 in the first sample after a pulse.
* FIFO: samples are stored only while DEN is active; the LSB changes from one active window to the next.
* edge: only the first sample after each active edge is shown.

Decisions where the documents are silent: data enable's stamp is also in the output registers; the next sample or the
read of a high byte ends DEN_DRDY.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, Violations
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL4_C,
    CTRL5_C,
    CTRL6_C,
    CTRL8_XL,
    CTRL9_XL,
    OUT_G,
    OUT_XL,
)
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS
from fcu_emulator.sensors.sampling import SampleStream, Times

# -- settings (datasheet 9.16 to 9.21) ----------------------------------------------------------------------

_MODE_LSB = CTRL6_C.LVL2_EN.lsb


class DenMode(IntEnum):
    """Mode by CTRL6_C: TRIG_EN, LVL1_EN, LVL2_EN."""

    OFF = 0b000
    LEVEL = 0b010
    LATCHED = 0b011
    EDGE = 0b100
    FIFO = 0b110


@dataclass(frozen=True)
class DenSettings:
    """Settings of data enable. ``stamp_xl``: the accelerometer is stamped instead of the gyroscope. ``axes``:
    the stamped axes of X, Y, Z.
    """

    mode: DenMode
    active_high: bool
    gates_xl: bool
    stamp_xl: bool
    axes: tuple[bool, bool, bool]

    @classmethod
    def decode(cls, mem: bytearray) -> DenSettings:
        mode, control = _mode(mem), mem[CTRL9_XL.addr]
        return cls(
            mode=DenMode(mode) if mode in set(DenMode) else DenMode.OFF,
            active_high=bool(mem[CTRL5_C.addr] & CTRL5_C.DEN_LH.mask),
            gates_xl=bool(mem[CTRL4_C.addr] & CTRL4_C.DEN_XL_EN.mask),
            stamp_xl=bool(control & CTRL9_XL.DEN_XL_G.mask),
            axes=(
                bool(control & CTRL9_XL.DEN_X.mask),
                bool(control & CTRL9_XL.DEN_Y.mask),
                bool(control & CTRL9_XL.DEN_Z.mask),
            ),
        )

    def begins_anew(self, old: DenSettings) -> bool:
        """Return whether earlier windows and marks are discarded."""
        return (self.mode, self.active_high, self.stamp_xl) != (old.mode, old.active_high, old.stamp_xl)


def violations(mem: bytearray) -> dict[tuple[str, str], bool]:
    """Return all kinds of invalid settings. The value is True if the registers have this setting."""
    mode = _mode(mem)
    gates_xl = mode == DenMode.EDGE and bool(mem[CTRL4_C.addr] & CTRL4_C.DEN_XL_EN.mask)
    return {
        ("den-mode", f"CTRL6_C: TRIG_EN, LVL1_EN, LVL2_EN = {mode:03b}b is not a data-enable mode"): mode
        not in set(DenMode),
        ("den-edge-with-lpf2", "CTRL4_C.DEN_XL_EN by edge needs CTRL8_XL.LPF2_XL_EN = 0"): gates_xl
        and bool(mem[CTRL8_XL.addr] & CTRL8_XL.LPF2_XL_EN.mask),
    }


def _mode(mem: bytearray) -> int:
    return mem[CTRL6_C.addr] >> _MODE_LSB


# -- edge mode: passes the first sample after each edge -----------------------------------------------------


class Gate:
    """The gate of one sensor. ``source``: the sensor's stream. ``shown``: the samples that are visible
    while the gate is ``closed``.
    """

    def __init__(self, source: SampleStream) -> None:
        self.source = source
        self.shown = SampleStream(6, self._produce)
        self.closed = False
        self._index = 0  # index of the passed sample
        self._pending = False

    def close(self, closed: bool, now_ps: int) -> None:
        self.catch_up(now_ps)
        if closed:
            self.shown.data = self.source.data
            self.shown.stop()
        else:
            self.source.data = self.shown.data  # shown until the next sample
        self.closed, self._pending = closed, False

    def open(self, at_ps: int) -> None:
        if self.closed:
            self._pending = True
            self.aim(at_ps)

    def aim(self, now_ps: int) -> None:
        """Let the gate pass the first sample after ``now_ps``."""
        if self._pending and self.source.running:
            self._index = self.source.latest(now_ps) + 1
            self.shown.start_single(now_ps, self.source.time_ps(self._index) - now_ps)

    def catch_up(self, now_ps: int) -> None:
        if not self.closed:
            return
        if self._pending and self.source.running and self.source.time_ps(self._index) <= now_ps:
            self._pending = False
        if now_ps >= self.source.next_ps:
            self.source.advance(now_ps)

    def _produce(self, number: int, t_s: Times) -> bytes:
        del number, t_s
        return self.source.samples(self._index, self._index + 1).tobytes()


# -- data enable --------------------------------------------------------------------------------------------

_NONE = -1


class DataEnable:
    """Data enable; ``stream_changed`` is called when a sensor's visible stream changes."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL1_XL,
        CTRL2_G,
        CTRL4_C,
        CTRL5_C,
        CTRL6_C,
        CTRL8_XL,
        CTRL9_XL,
    )

    def __init__(self, chip: FeatureContext, stream_changed: Callable[[], None]) -> None:
        self.active = False
        self._chip = chip
        self._mem = chip.registers.mem
        self._stream_changed = stream_changed
        self._violations = Violations(chip)
        self._settings = DenSettings.decode(self._mem)
        self._gates = {"xl": Gate(chip.xl), "g": Gate(chip.g)}
        self._den_active = False
        self._windows = 0  # windows of FIFO mode, including the present one
        self._latched = _NONE  # sample marked by the latest pulse
        self._next = 0  # DEN_DRDY: first unprocessed sample
        self._wired = False

    # -- for the sensor ---------------------------------------------------------------------------------

    def level_changes(self, level: int, at_ps: int) -> None:
        """React to a new level of INT2; the caller then calls ``configure``."""
        was, self._den_active = self._den_active, bool(level) == self._settings.active_high
        if was or not self._den_active:
            return
        self._windows += 1
        if self._settings.mode is DenMode.LATCHED:
            self._latched = self._stamped().next_number(at_ps)
        for gate in self._gates.values():
            gate.open(at_ps)

    # -- feature interface ------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        """Decode the registers. A mark for a future sample is kept."""
        old, settings = self._settings, DenSettings.decode(self._mem)
        self._settings = settings
        if settings.begins_anew(old):
            self._den_active = bool(self._chip.int2.applied) == settings.active_high
            self._windows = int(self._den_active)
            self._latched = _NONE
        self.active = settings.mode is not DenMode.OFF
        self._chip.gates.fifo_open = settings.mode is not DenMode.FIFO or self._den_active
        edge = settings.mode is DenMode.EDGE
        self._close("g", edge, now_ps)
        self._close("xl", edge and settings.gates_xl, now_ps)
        self._next = self._shown().latest(now_ps) + 1
        if self.active and not self._wired:
            self._wire()
        if not self.active:
            self._chip.signals.set("DEN_DRDY", False, now_ps)
        self._violations.report(violations(self._mem), now_ps)

    def catch_up(self, now_ps: int) -> None:
        for gate in self._gates.values():
            gate.catch_up(now_ps)
        stream = self._shown()
        latest = stream.latest(now_ps)
        if not stream.running or latest < self._next:
            return
        signals = self._chip.signals
        if self._settings.mode is DenMode.LATCHED:
            marked = self._latched - stream.number(0)
            if self._next <= marked <= latest:
                signals.set("DEN_DRDY", True, stream.time_ps(marked))
            after = max(self._next, marked + 1)
            if after <= latest:
                signals.set("DEN_DRDY", False, stream.time_ps(after))
        else:
            passed = self._settings.mode is DenMode.EDGE and stream is not self._stamped()
            enabled = passed or self._den_active
            signals.set("DEN_DRDY", enabled, stream.time_ps(self._next))
        self._next = latest + 1

    def reset(self, now_ps: int) -> None:
        self._chip.signals.set("DEN_DRDY", False, now_ps)

    def next_event_ps(self) -> int:
        stream = self._shown()
        if not stream.running or not self._mem[CTRL4_C.addr] & CTRL4_C.DEN_DRDY_INT1.mask:
            return NEVER_PS
        return stream.time_ps(self._next)

    # -- internals --------------------------------------------------------------------------------------

    def _stamped(self) -> SampleStream:
        return self._chip.xl if self._settings.stamp_xl else self._chip.g

    def _shown(self) -> SampleStream:
        return self._chip.gates.shown(self._stamped())

    def _close(self, name: str, closed: bool, now_ps: int) -> None:
        gate = self._gates[name]
        if closed != gate.closed:
            gate.close(closed, now_ps)
            self._chip.gates.show(gate.source, gate.shown if closed else None)
            self._stream_changed()
        elif closed:
            gate.aim(now_ps)

    def _wire(self) -> None:
        self._wired = True
        chip = self._chip
        for stream, register in ((chip.xl, OUT_XL), (chip.g, OUT_G)):
            stream.stamp_with(self._stamper(stream))
            chip.registers.after_read(register, self._after_read(stream, register))

    def _stamper(self, stream: SampleStream) -> Callable[[int, bytes], bytes]:
        def stamp(number: int, data: bytes) -> bytes:
            if stream is not self._stamped() or self._settings.mode in {DenMode.OFF, DenMode.EDGE}:
                return data
            return self._stamp(number, data)

        return stamp

    def _stamp(self, number: int, data: bytes) -> bytes:
        words = np.frombuffer(data, dtype="<i2").reshape(-1, 3).copy()
        bits = np.zeros(len(words), dtype=np.int16)
        if self._settings.mode is DenMode.LATCHED:
            bits[np.arange(number, number + len(words)) == self._latched] = 1
        elif self._settings.mode is DenMode.LEVEL:
            bits[:] = self._den_active
        else:
            # between two windows, the LSB has the value of the previous window
            bits[:] = self._windows > 0 and self._windows % 2 == 0
        for axis, on in enumerate(self._settings.axes):
            if on:
                words[:, axis] = words[:, axis] & ~1 | bits
        return words.tobytes()

    def _after_read(self, stream: SampleStream, register: type[Register]) -> Callable[[int, int, int], None]:
        def after_read(first: int, end: int, now_ps: int) -> None:
            high_byte = any((address - register.addr) % 2 for address in range(first, end))
            if self.active and stream is self._stamped() and high_byte:
                self._chip.catch_up(now_ps)
                self._chip.signals.set("DEN_DRDY", False, now_ps)
                self._chip.catch_up(now_ps)  # for the pin

        return after_read
