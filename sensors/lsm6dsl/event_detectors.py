"""Single and double tap (AN5040 5.5).

The slope of an enabled axis rises over TAP_THS and falls back within SHOCK: a tap. QUIET follows, in which
nothing counts; with SINGLE_DOUBLE_TAP a second tap that begins after QUIET and within DUR is a double tap.
An event lasts as long as its QUIET window. All windows are counted in samples from the sample that opened
them.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from sensors.lsm6dsl.event_motion_filter import Axes
from sensors.lsm6dsl.registers import INT_DUR2, TAP_CFG, TAP_SRC, TAP_THS_6D, WAKE_UP_THS

_State: TypeAlias = Literal["idle", "shock", "quiet", "second"]
_AXES = (TAP_SRC.X_TAP.mask, TAP_SRC.Y_TAP.mask, TAP_SRC.Z_TAP.mask)


class Tap:
    """``step`` gives the bits of TAP_SRC; both events may be enabled but are never on at once."""

    def __init__(self) -> None:
        self._state: _State = "idle"
        self._count = 0  # samples since the state began
        self._is_second = False  # the shock or quiet time at hand is that of a possible second tap
        self._over = False
        self._bits = 0
        self._enabled = (False, False, False)
        self._threshold_mg = 0.0
        self._shock = self._quiet = self._gap = 0
        self._double = False

    def configure(self, mem: bytearray, full_scale_mg: int) -> None:
        """Read axes, threshold, windows and mode."""
        config, windows = mem[TAP_CFG.addr], mem[INT_DUR2.addr]
        bits = TAP_CFG.TAP_X_EN, TAP_CFG.TAP_Y_EN, TAP_CFG.TAP_Z_EN
        self._enabled = (bool(bits[0].get(config)), bool(bits[1].get(config)), bool(bits[2].get(config)))
        self._threshold_mg = TAP_THS_6D.TAP_THS.get(mem[TAP_THS_6D.addr]) * full_scale_mg / 32
        self._shock = 8 * INT_DUR2.SHOCK.get(windows) or 4
        self._quiet = 4 * INT_DUR2.QUIET.get(windows) or 2
        self._gap = 32 * INT_DUR2.DUR.get(windows) or 16
        self._double = bool(mem[WAKE_UP_THS.addr] & WAKE_UP_THS.SINGLE_DOUBLE_TAP.mask)
        if not any(self._enabled):
            self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._state, self._count, self._over, self._bits = "idle", 0, False, 0

    def step(self, slope: Axes) -> int:
        """The next slope in mg; bits of TAP_SRC while an event lasts, else 0."""
        over = self._exceeds(slope)
        begins = over and not self._over
        self._over = over
        self._count += 1
        if self._state == "quiet" and self._count >= self._quiet:
            self._enter("second" if self._double and not self._is_second else "idle")
        if self._state == "shock":
            self._in_shock(over)
        elif self._state != "quiet" and begins and not self._too_late():
            self._begin(slope, is_second=self._state == "second")
        elif self._state == "second" and self._too_late():
            self._enter("idle")
        return self._bits if self._state == "quiet" else 0

    def _too_late(self) -> bool:
        return self._state == "second" and self._count >= self._gap

    def _exceeds(self, slope: Axes) -> bool:
        limit = self._threshold_mg
        x, y, z = self._enabled
        return (
            (x and not -limit <= slope[0] <= limit)
            or (y and not -limit <= slope[1] <= limit)
            or (z and not -limit <= slope[2] <= limit)
        )

    def _enter(self, state: _State) -> None:
        self._state, self._count = state, 0

    def _begin(self, slope: Axes, *, is_second: bool) -> None:
        """A shock begins: remember its axes, and the sign of the strongest."""
        self._is_second = is_second
        sizes = [abs(value) if on else 0.0 for value, on in zip(slope, self._enabled, strict=True)]
        self._bits = TAP_SRC.TAP_IA.mask
        for size, bit in zip(sizes, _AXES, strict=True):
            self._bits |= bit if size > self._threshold_mg else 0
        if slope[sizes.index(max(sizes))] < 0:
            self._bits |= TAP_SRC.TAP_SIGN.mask
        self._enter("shock")

    def _in_shock(self, over: bool) -> None:
        if self._count > self._shock:  # no tap: it lasts too long; the next one has to begin anew
            self._enter("idle")
        elif not over:
            self._bits |= TAP_SRC.DOUBLE_TAP.mask if self._is_second else TAP_SRC.SINGLE_TAP.mask
            self._enter("quiet")
