"""FUNC_SRC1, FUNC_SRC2 and WRIST_TILT_IA: how events of embedded functions and sensor hub end.

With TAP_CFG.LIR = 0 the signal is a pulse of 150 us and the bit reads 1 for 1/26 s, or 1/100 s (AN5040 6, 7.5.3). With
LIR = 1 a routed event stays until it is read.

Decisions where the documents are silent: if a bit is not latched, a read does not clear it; a latched event ends when
its latching or its function is switched off.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, SignalName
from fcu_emulator.sensors.lsm6dsl.registers import (
    DRDY_PULSE_CFG_G,
    FUNC_SRC1,
    FUNC_SRC2,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD1_CFG,
    MD2_CFG,
    TAP_CFG,
    WRIST_TILT_IA,
)
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS
from fcu_emulator.sensors.sampling import PS_PER_S

_PIN_PULSE_PS = 150 * PS_PER_S // 10**6
_FUNCTION_PERIOD_PS = -(-PS_PER_S // 26)
_IRON_PERIOD_PS = PS_PER_S // 100


@dataclass(frozen=True, eq=False)
class FunctionSource:
    """An event with its bit, its signal, and its routing bits. An event latches only if it is routed.

    ``bit_ps``: duration of the bit if it does not latch; None: until it is cleared.
    """

    register: type[Register]
    mask: int
    signal: SignalName
    routes: tuple[tuple[type[Register], int], ...]
    bit_ps: int | None = _FUNCTION_PERIOD_PS


STEP = FunctionSource(
    FUNC_SRC1,
    FUNC_SRC1.STEP_DETECTED.mask,
    "STEP_DETECTOR",
    ((INT1_CTRL, INT1_CTRL.INT1_STEP_DETECTOR.mask),),
)
STEP_OVERFLOW = FunctionSource(
    FUNC_SRC1,
    FUNC_SRC1.STEP_OVERFLOW.mask,
    "STEP_COUNT_OV",
    ((INT2_CTRL, INT2_CTRL.INT2_STEP_COUNT_OV.mask),),
)
STEP_DELTA = FunctionSource(
    FUNC_SRC1,
    FUNC_SRC1.STEP_COUNT_DELTA_IA.mask,
    "STEP_DELTA",
    ((INT2_CTRL, INT2_CTRL.INT2_STEP_DELTA.mask),),
)
SIGNIFICANT_MOTION = FunctionSource(
    FUNC_SRC1, FUNC_SRC1.SIGN_MOTION_IA.mask, "SIGN_MOT", ((INT1_CTRL, INT1_CTRL.INT1_SIGN_MOT.mask),)
)
TILT = FunctionSource(
    FUNC_SRC1,
    FUNC_SRC1.TILT_IA.mask,
    "TILT",
    ((MD1_CFG, MD1_CFG.INT1_TILT.mask), (MD2_CFG, MD2_CFG.INT2_TILT.mask)),
)
WRIST_TILT = FunctionSource(
    FUNC_SRC2,
    FUNC_SRC2.WRIST_TILT_IA.mask,
    "WRIST_TILT",
    ((DRDY_PULSE_CFG_G, DRDY_PULSE_CFG_G.INT2_WRIST_TILT.mask),),
)
_HUB_ROUTES = ((MASTER_CONFIG, MASTER_CONFIG.DRDY_ON_INT1.mask),)
HUB_IDLE = FunctionSource(FUNC_SRC1, FUNC_SRC1.SENSORHUB_END_OP.mask, "SENSORHUB", _HUB_ROUTES, None)
HUB_CORRECTED = FunctionSource(
    FUNC_SRC1, FUNC_SRC1.SENSORHUB_END_OP.mask, "SENSORHUB", _HUB_ROUTES, _IRON_PERIOD_PS
)
IRON = FunctionSource(
    FUNC_SRC1,
    FUNC_SRC1.SI_END_OP.mask,
    "IRON",
    ((MD2_CFG, MD2_CFG.INT2_IRON.mask),),
    _IRON_PERIOD_PS,
)
_SOURCES = (
    STEP,
    STEP_OVERFLOW,
    STEP_DELTA,
    SIGNIFICANT_MOTION,
    TILT,
    WRIST_TILT,
    HUB_IDLE,
    HUB_CORRECTED,
    IRON,
)


class FunctionSources:
    """Owner of the source registers. In the list of features, it comes after the features that report events."""

    CONFIGURATION: tuple[type[Register], ...] = (
        DRDY_PULSE_CFG_G,
        INT1_CTRL,
        INT2_CTRL,
        MASTER_CONFIG,
        MD1_CFG,
        MD2_CFG,
        TAP_CFG,
    )

    def __init__(self, chip: FeatureContext) -> None:
        self.active = False
        self._chip = chip
        self._mem = chip.registers.mem
        self._latching: set[FunctionSource] = set()
        self._held: set[FunctionSource] = set()
        self._pin_ends: dict[FunctionSource, int] = {}
        self._bit_ends: dict[FunctionSource, int] = {}
        for register in (FUNC_SRC1, FUNC_SRC2, WRIST_TILT_IA):
            chip.registers.before_read(register, self._before_read)
        chip.registers.after_read(FUNC_SRC1, self._release_func_src1)
        chip.registers.after_read(FUNC_SRC2, self._release_func_src2)

    # -- for the functions ------------------------------------------------------------------------------

    def happened(self, source: FunctionSource, at_ps: int) -> None:
        self.catch_up(at_ps)
        self._mem[source.register.addr] |= source.mask
        if source in self._latching:
            self._held.add(source)
        else:
            self._pin_ends[source] = at_ps + _PIN_PULSE_PS
            if source.bit_ps is not None:
                self._bit_ends[source] = at_ps + source.bit_ps
            self.active = True
        self._chip.signals.set(source.signal, on=True, at_ps=at_ps)

    def show(self, source: FunctionSource, *, on: bool) -> None:
        """Set or clear the bit of a level source, unless it latches."""
        if source not in self._latching:
            self._set_bit(source, on=on)

    def fall(self, sources: Iterable[FunctionSource], at_ps: int) -> None:
        self.catch_up(at_ps)
        for source in sources:
            self._held.discard(source)
            self._pin_ends.pop(source, None)
            self._bit_ends.pop(source, None)
            self._set_bit(source, on=False)
            self._chip.signals.set(source.signal, on=False, at_ps=at_ps)
        self.active = bool(self._pin_ends or self._bit_ends)

    # -- feature interface ------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        mem = self._mem
        latches = bool(mem[TAP_CFG.addr] & TAP_CFG.LIR.mask)
        was, self._latching = (
            self._latching,
            {
                source
                for source in _SOURCES
                if latches and any(mem[register.addr] & mask for register, mask in source.routes)
            },
        )
        if HUB_IDLE in self._latching - was:
            self._set_bit(HUB_IDLE, on=False)  # the level has ended; the bit waits for the next event
        self.fall([source for source in self._held_in_order() if source not in self._latching], now_ps)

    def catch_up(self, now_ps: int) -> None:
        if not self.active:
            return
        over = [(end, source) for source, end in self._pin_ends.items() if end <= now_ps]
        for end, source in sorted(over, key=lambda entry: entry[0]):
            del self._pin_ends[source]
            self._chip.signals.set(source.signal, on=False, at_ps=end)
        for source in [source for source, end in self._bit_ends.items() if end <= now_ps]:
            del self._bit_ends[source]
            self._set_bit(source, on=False)
        self.active = bool(self._pin_ends or self._bit_ends)

    def reset(self, now_ps: int) -> None:
        self.fall(_SOURCES, now_ps)

    def next_event_ps(self) -> int:
        return min(self._pin_ends.values(), default=NEVER_PS)

    # -- registers --------------------------------------------------------------------------------------

    def _before_read(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._chip.catch_up(now_ps)

    def _release_func_src1(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self.fall([source for source in self._held_in_order() if source.register is FUNC_SRC1], now_ps)

    def _release_func_src2(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self.fall([source for source in self._held_in_order() if source.register is FUNC_SRC2], now_ps)

    def _held_in_order(self) -> list[FunctionSource]:
        """Return the held sources in a fixed order; the order of a set varies."""
        return [source for source in _SOURCES if source in self._held]

    def _set_bit(self, source: FunctionSource, *, on: bool) -> None:
        address = source.register.addr
        if on:
            self._mem[address] |= source.mask
            return
        self._mem[address] &= ~source.mask
        if source is WRIST_TILT:
            self._mem[WRIST_TILT_IA.addr] = 0
