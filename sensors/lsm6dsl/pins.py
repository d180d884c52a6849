"""The pins INT1 and INT2: which signals are ORed onto them, and how they are driven (AN5040 section 4.2).

Functions find out late, and one after the other, what happened early; so changes are collected here and
applied in the order of their times once every function has caught up. That is why this feature has to be the
last in the model's list.

Decision: while INT2 is an input (data enable, or a sensor hub triggered from outside) it is not driven and
its sources are lost; the documents do not say where else they would go.
"""

from __future__ import annotations

from functools import partial
from typing import TypeAlias

from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.registers import (
    CTRL3_C,
    CTRL4_C,
    CTRL6_C,
    DRDY_PULSE_CFG_G,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD1_CFG,
    MD2_CFG,
)
from sensors.lsm6dsl.signals import SIGNALS, SignalName
from sensors.pin import Pin
from sensors.register import Bits, Register
from sensors.sampling import NEVER_PS

_Source: TypeAlias = tuple[type[Register], Bits, SignalName]
_Levels: TypeAlias = tuple[int | None, int | None]
"""Of a pin that is inactive, and active; None: not driven."""

Routed: TypeAlias = frozenset[SignalName]

INT1_SOURCES: tuple[_Source, ...] = (
    (INT1_CTRL, INT1_CTRL.INT1_STEP_DETECTOR, "STEP_DETECTOR"),
    (INT1_CTRL, INT1_CTRL.INT1_SIGN_MOT, "SIGN_MOT"),
    (INT1_CTRL, INT1_CTRL.INT1_FULL_FLAG, "FULL_FLAG"),
    (INT1_CTRL, INT1_CTRL.INT1_FIFO_OVR, "FIFO_OVR"),
    (INT1_CTRL, INT1_CTRL.INT1_FTH, "FTH"),
    (INT1_CTRL, INT1_CTRL.INT1_BOOT, "BOOT"),
    (INT1_CTRL, INT1_CTRL.INT1_DRDY_G, "DRDY_G"),
    (INT1_CTRL, INT1_CTRL.INT1_DRDY_XL, "DRDY_XL"),
    (MD1_CFG, MD1_CFG.INT1_INACT_STATE, "INACT_STATE"),
    (MD1_CFG, MD1_CFG.INT1_SINGLE_TAP, "SINGLE_TAP"),
    (MD1_CFG, MD1_CFG.INT1_WU, "WU"),
    (MD1_CFG, MD1_CFG.INT1_FF, "FF"),
    (MD1_CFG, MD1_CFG.INT1_DOUBLE_TAP, "DOUBLE_TAP"),
    (MD1_CFG, MD1_CFG.INT1_6D, "6D"),
    (MD1_CFG, MD1_CFG.INT1_TILT, "TILT"),
    (MD1_CFG, MD1_CFG.INT1_TIMER, "TIMER"),
    (MASTER_CONFIG, MASTER_CONFIG.DRDY_ON_INT1, "SENSORHUB"),
    (CTRL4_C, CTRL4_C.DEN_DRDY_INT1, "DEN_DRDY"),
)
INT2_SOURCES: tuple[_Source, ...] = (
    (INT2_CTRL, INT2_CTRL.INT2_STEP_DELTA, "STEP_DELTA"),
    (INT2_CTRL, INT2_CTRL.INT2_STEP_COUNT_OV, "STEP_COUNT_OV"),
    (INT2_CTRL, INT2_CTRL.INT2_FULL_FLAG, "FULL_FLAG"),
    (INT2_CTRL, INT2_CTRL.INT2_FIFO_OVR, "FIFO_OVR"),
    (INT2_CTRL, INT2_CTRL.INT2_FTH, "FTH"),
    (INT2_CTRL, INT2_CTRL.INT2_DRDY_TEMP, "DRDY_TEMP"),
    (INT2_CTRL, INT2_CTRL.INT2_DRDY_G, "DRDY_G"),
    (INT2_CTRL, INT2_CTRL.INT2_DRDY_XL, "DRDY_XL"),
    (MD2_CFG, MD2_CFG.INT2_INACT_STATE, "INACT_STATE"),
    (MD2_CFG, MD2_CFG.INT2_SINGLE_TAP, "SINGLE_TAP"),
    (MD2_CFG, MD2_CFG.INT2_WU, "WU"),
    (MD2_CFG, MD2_CFG.INT2_FF, "FF"),
    (MD2_CFG, MD2_CFG.INT2_DOUBLE_TAP, "DOUBLE_TAP"),
    (MD2_CFG, MD2_CFG.INT2_6D, "6D"),
    (MD2_CFG, MD2_CFG.INT2_TILT, "TILT"),
    (MD2_CFG, MD2_CFG.INT2_IRON, "IRON"),
    (DRDY_PULSE_CFG_G, DRDY_PULSE_CFG_G.INT2_WRIST_TILT, "WRIST_TILT"),
)


def routes(mem: bytearray) -> tuple[Routed, Routed]:
    """The signals on INT1 and on INT2, as the main bank's registers say."""
    int1 = frozenset(name for register, bit, name in INT1_SOURCES if mem[register.addr] & bit.mask)
    int2 = frozenset(name for register, bit, name in INT2_SOURCES if mem[register.addr] & bit.mask)
    if mem[CTRL4_C.addr] & CTRL4_C.INT2_on_INT1.mask:
        return int1 | int2, frozenset()
    return int1, int2


def int2_is_input(mem: bytearray) -> bool:
    """In every data-enable mode, and while the sensor hub is triggered from outside."""
    data_enable = CTRL6_C.TRIG_EN.mask | CTRL6_C.LVL1_EN.mask | CTRL6_C.LVL2_EN.mask
    triggered = MASTER_CONFIG.MASTER_ON.mask | MASTER_CONFIG.START_CONFIG.mask
    return bool(mem[CTRL6_C.addr] & data_enable) or mem[MASTER_CONFIG.addr] & triggered == triggered


class Routing:
    """Drives both pins; ``active`` while anything is routed to one of them."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL3_C,
        CTRL4_C,
        CTRL6_C,
        DRDY_PULSE_CFG_G,
        INT1_CTRL,
        INT2_CTRL,
        MASTER_CONFIG,
        MD1_CFG,
        MD2_CFG,
    )

    def __init__(self, chip: Chip) -> None:
        self.active = False
        self._chip = chip
        self._on: set[SignalName] = set()  # of the routed signals, as far as applied
        self._int1: Routed = frozenset()
        self._int2: Routed = frozenset()
        self._routed: Routed = frozenset()
        self._pending: list[tuple[int, SignalName, bool]] = []
        self._levels: _Levels = (0, 1)
        self._int2_is_input = False
        for name in SIGNALS:
            chip.signals.listen(name, partial(self._heard, name))

    def configure(self, now_ps: int) -> None:
        """Another routing or another way to drive the pins, from ``now_ps`` on."""
        self.catch_up(now_ps)
        mem = self._chip.registers.mem
        self._int1, self._int2 = routes(mem)
        routed = self._int1 | self._int2
        fresh = {name for name in routed - self._routed if self._chip.signals[name]}
        self._on = (self._on & routed) | fresh
        self._routed = routed
        self.active = bool(routed)
        self._pending = [change for change in self._pending if change[1] in routed]
        self._levels = _levels(mem[CTRL3_C.addr])
        self._int2_is_input = int2_is_input(mem)
        self._drive(now_ps)

    def catch_up(self, now_ps: int) -> None:
        """Apply the changes up to ``now_ps``; those of the same time together, so that no glitch appears."""
        pending = self._pending
        if not pending:
            return
        pending.sort(key=lambda change: change[0])
        while pending and pending[0][0] <= now_ps:
            at_ps = pending[0][0]
            while pending and pending[0][0] == at_ps:
                _, name, on = pending.pop(0)
                (self._on.add if on else self._on.discard)(name)
            self._drive(at_ps)

    def reset(self, now_ps: int) -> None:
        """Nothing is routed; the pins settle when ``configure`` follows."""
        del now_ps
        self._pending.clear()
        self._on.clear()

    def next_event_ps(self) -> int:
        """The earliest change that is known but not applied yet."""
        return min((change[0] for change in self._pending), default=NEVER_PS)

    def _heard(self, name: SignalName, on: bool, at_ps: int) -> None:
        if name in self._routed:
            self._pending.append((at_ps, name, on))

    def _drive(self, at_ps: int) -> None:
        self._set(self._chip.int1, self._int1, at_ps)
        if self._int2_is_input:
            self._chip.int2.drive(None, at_ps)
        else:
            self._set(self._chip.int2, self._int2, at_ps)

    def _set(self, pin: Pin, routed: Routed, at_ps: int) -> None:
        pin.drive(self._levels[not routed.isdisjoint(self._on)], at_ps)


def _levels(control: int) -> _Levels:
    """H_LACTIVE inverts the pins; with PP_OD only their active level is driven."""
    active = 0 if control & CTRL3_C.H_LACTIVE.mask else 1
    return None if control & CTRL3_C.PP_OD.mask else 1 - active, active
