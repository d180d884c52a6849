"""The pins INT1 and INT2, and data-ready and boot signals (AN5040 4.2, 4.3, 5.7).

:class:`Routing` comes at the end of the model's list, and applies changes in the order of their times.

Decision: while INT2 is an input, the sensor does not drive it, and signals routed to it are lost.

DRDY_PULSED selects pulses of 75 us; DRDY_MASK suppresses signals until a sensor has settled.
"""

from __future__ import annotations

from functools import partial
from typing import TypeAlias

from fcu_emulator.sensors.lsm6dsl.feature import SIGNAL_NAMES, FeatureContext, SignalName, Signals
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    CTRL4_C,
    CTRL6_C,
    DRDY_PULSE_CFG_G,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD1_CFG,
    MD2_CFG,
    OUT_G,
    OUT_TEMP,
    OUT_XL,
    STATUS_REG,
)
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register import Bits, Register
from fcu_emulator.sensors.register_file import NEVER_PS, AfterHook
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream

# -- routing ------------------------------------------------------------------------------------------------

_Source: TypeAlias = tuple[type[Register], Bits, SignalName]
_Levels: TypeAlias = tuple[int | None, int | None]
"""Levels of an inactive and an active pin; None: not driven."""

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
    """Return the signals on INT1 and on INT2."""
    int1 = frozenset(name for register, bit, name in INT1_SOURCES if mem[register.addr] & bit.mask)
    int2 = frozenset(name for register, bit, name in INT2_SOURCES if mem[register.addr] & bit.mask)
    if mem[CTRL4_C.addr] & CTRL4_C.INT2_on_INT1.mask:
        return int1 | int2, frozenset()
    return int1, int2


def int2_is_input(mem: bytearray) -> bool:
    """Return whether INT2 is an input: for data enable, or an externally triggered hub."""
    data_enable = CTRL6_C.TRIG_EN.mask | CTRL6_C.LVL1_EN.mask | CTRL6_C.LVL2_EN.mask
    triggered = MASTER_CONFIG.MASTER_ON.mask | MASTER_CONFIG.START_CONFIG.mask
    return bool(mem[CTRL6_C.addr] & data_enable) or mem[MASTER_CONFIG.addr] & triggered == triggered


class Routing:
    """Driver of both pins; ``active`` while a signal is routed to a pin."""

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

    def __init__(self, chip: FeatureContext) -> None:
        self.active = False
        self._chip = chip
        self._on: set[SignalName] = set()  # routed signals that are active and applied
        self._int1: Routed = frozenset()
        self._int2: Routed = frozenset()
        self._routed: Routed = frozenset()
        self._pending: list[tuple[int, SignalName, bool]] = []
        self._levels: _Levels = (0, 1)
        self._int2_is_input = False
        for name in SIGNAL_NAMES:
            chip.signals.listen(name, partial(self._heard, name))

    def configure(self, now_ps: int) -> None:
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
        """Apply changes in order. Simultaneous changes are applied together, so that no glitch appears."""
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
        del now_ps
        self._pending.clear()
        self._on.clear()

    def next_event_ps(self) -> int:
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
    """Return the levels. H_LACTIVE inverts them; with PP_OD only the active level is driven."""
    active = 0 if control & CTRL3_C.H_LACTIVE.mask else 1
    return None if control & CTRL3_C.PP_OD.mask else 1 - active, active


# -- data-ready ---------------------------------------------------------------------------------------------

PULSE_PS = 75 * PS_PER_S // 10**6


class _SensorSignal:
    """The data-ready signal of one sensor. ``next`` is the first sample that has not been signalled."""

    def __init__(self, name: SignalName, flag: int, stream: SampleStream) -> None:
        self.name: SignalName = name
        self.flag = flag
        self.sensor = self.stream = stream  # ``stream`` may become the stream of the sensor's gate
        self.next = 0
        self.routed = False


class DataReadySignals:
    """Data-ready signals; ``active`` while any of these signals is routed."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL1_XL,
        CTRL2_G,
        CTRL4_C,
        DRDY_PULSE_CFG_G,
        INT1_CTRL,
        INT2_CTRL,
    )

    def __init__(self, chip: FeatureContext) -> None:
        self.active = False
        self._chip = chip
        self._pulsed = self._masked = self._wired = False
        self._sources = (
            _SensorSignal("DRDY_XL", STATUS_REG.XLDA.mask, chip.xl),
            _SensorSignal("DRDY_G", STATUS_REG.GDA.mask, chip.g),
            _SensorSignal("DRDY_TEMP", STATUS_REG.TDA.mask, chip.temperature),
        )

    def configure(self, now_ps: int) -> None:
        mem = self._chip.registers.mem
        int1, int2 = routes(mem)
        was_pulsed = self._pulsed
        self._pulsed = bool(mem[DRDY_PULSE_CFG_G.addr] & DRDY_PULSE_CFG_G.DRDY_PULSED.mask)
        self._masked = bool(mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask)
        for source in self._sources:
            source.stream = self._chip.gates.shown(source.sensor)
            was_routed, source.routed = source.routed, source.name in int1 | int2
            source.next = source.stream.latest(now_ps) + 1
            if self._masked:
                source.next = max(source.next, source.stream.settled_index)
            if self._masked or (was_routed, was_pulsed) != (source.routed, self._pulsed):
                self._follow_flag(source, now_ps)
        self.active = any(source.routed for source in self._sources)
        if self.active and not self._wired:
            self._wire()

    def catch_up(self, now_ps: int) -> None:
        for source in self._sources:
            stream = source.stream
            if not source.routed or not stream.running:
                continue
            latest = stream.latest(now_ps)
            if latest < source.next:
                continue
            if self._pulsed:
                self._pulse(source, latest)
            else:
                self._chip.signals.set(source.name, True, stream.time_ps(source.next))
            source.next = latest + 1

    def reset(self, now_ps: int) -> None:
        for source in self._sources:
            self._chip.signals.set(source.name, False, now_ps)

    def next_event_ps(self) -> int:
        signals = self._chip.signals
        return min(
            (
                source.stream.time_ps(source.next)
                for source in self._sources
                if source.routed and source.stream.running and not signals[source.name]
            ),
            default=NEVER_PS,
        )

    def _wire(self) -> None:
        self._wired = True
        for register, source in zip((OUT_XL, OUT_G, OUT_TEMP), self._sources, strict=True):
            self._chip.registers.after_read(register, self._hook(source))

    def _hook(self, source: _SensorSignal) -> AfterHook:
        def after_read(first: int, end: int, now_ps: int) -> None:
            del first, end
            self._after_read(source, now_ps)

        return after_read

    def _pulse(self, source: _SensorSignal, latest: int) -> None:
        # Without listeners, only the latest pulse has an effect.
        wired = self._chip.int1.wired or self._chip.int2.wired
        for index in range(source.next if wired else latest, latest + 1):
            at_ps = source.stream.time_ps(index)
            self._chip.signals.set(source.name, True, at_ps)
            self._chip.signals.set(source.name, False, at_ps + PULSE_PS)

    def _follow_flag(self, source: _SensorSignal, now_ps: int) -> None:
        flag = self._chip.registers.mem[STATUS_REG.addr] & source.flag
        hidden = self._masked and source.stream.index < source.stream.settled_index
        on = source.routed and bool(flag) and not (self._pulsed or hidden)
        self._chip.signals.set(source.name, on, now_ps)

    def _after_read(self, source: _SensorSignal, now_ps: int) -> None:
        self._chip.catch_up(now_ps)
        if source.routed and not self._pulsed:
            self._follow_flag(source, now_ps)
            self._chip.catch_up(now_ps)


# -- boot ---------------------------------------------------------------------------------------------------

BOOT_PS = 15 * PS_PER_S // 10**3


class Boot:
    """The boot signal; ``active`` from a boot's start until its end is observed."""

    CONFIGURATION: tuple[type[Register], ...] = ()

    def __init__(self, signals: Signals) -> None:
        self.active = False
        self._signals = signals
        self._until_ps = 0

    def begin(self, now_ps: int) -> None:
        self.active = True
        self._until_ps = now_ps + BOOT_PS
        self._signals.set("BOOT", True, now_ps)

    def configure(self, now_ps: int) -> None:
        """Do nothing: no register affects a boot."""

    def catch_up(self, now_ps: int) -> None:
        if now_ps >= self._until_ps:
            self.active = False
            self._signals.set("BOOT", False, self._until_ps)

    def reset(self, now_ps: int) -> None:
        """Do nothing: SW_RESET does not end a boot."""

    def next_event_ps(self) -> int:
        return self._until_ps
