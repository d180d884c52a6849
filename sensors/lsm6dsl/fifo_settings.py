"""What the registers say about the FIFO of the LSM6DSL (AN5040 Rev 3, section 8; datasheet 5.5, 9.4 to 9.8).

Decisions where the documents are silent or disagree: reserved modes (2, 5, 7) are taken as bypass, reserved
rates (ODR_FIFO above 10) as off; a watermark of 0 is never reached and limits nothing; the rate is limited by
the faster sensor (AN5040 figure 32; the datasheet's 5.5 says by both); with ONLY_HIGH_DATA a second set that
should not be there is stored as usual.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum
from math import lcm

from sensors.lsm6dsl.accelerometer import ODR_HZ
from sensors.lsm6dsl.fifo_buffer import WORDS
from sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    FIFO_CTRL1,
    FIFO_CTRL2,
    FIFO_CTRL3,
    FIFO_CTRL4,
    FIFO_CTRL5,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD2_CFG,
)
from sensors.lsm6dsl.signals import SignalName
from sensors.register import Register

CONFIGURATION: tuple[type[Register], ...] = (
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    FIFO_CTRL1,
    FIFO_CTRL2,
    FIFO_CTRL3,
    FIFO_CTRL4,
    FIFO_CTRL5,
    INT1_CTRL,
    INT2_CTRL,
    MASTER_CONFIG,
    MD2_CFG,
)
"""The registers that say what the FIFO does."""

_DECIMATION = (0, 1, 2, 3, 4, 8, 16, 32)  # of every DEC_* field; 0: the set is not in the FIFO
SET_WORDS = 3

_INT1_FLAGS = INT1_CTRL.INT1_FULL_FLAG.mask | INT1_CTRL.INT1_FIFO_OVR.mask | INT1_CTRL.INT1_FTH.mask
_INT2_FLAGS = INT2_CTRL.INT2_FULL_FLAG.mask | INT2_CTRL.INT2_FIFO_OVR.mask | INT2_CTRL.INT2_FTH.mask

# What may switch a triggered mode over: each only if routed to the pin its bit names (AN5040, section 8).
_TRIGGERS: tuple[tuple[SignalName, int, int], ...] = (
    ("SIGN_MOT", INT1_CTRL.addr, INT1_CTRL.INT1_SIGN_MOT.mask),
    ("STEP_DETECTOR", INT1_CTRL.addr, INT1_CTRL.INT1_STEP_DETECTOR.mask),
    ("TILT", MD2_CFG.addr, MD2_CFG.INT2_TILT.mask),
    ("SINGLE_TAP", MD2_CFG.addr, MD2_CFG.INT2_SINGLE_TAP.mask),
    ("DOUBLE_TAP", MD2_CFG.addr, MD2_CFG.INT2_DOUBLE_TAP.mask),
    ("FF", MD2_CFG.addr, MD2_CFG.INT2_FF.mask),
    ("WU", MD2_CFG.addr, MD2_CFG.INT2_WU.mask),
    ("6D", MD2_CFG.addr, MD2_CFG.INT2_6D.mask),
)
TRIGGERS: tuple[SignalName, ...] = tuple(name for name, _, _ in _TRIGGERS)


class Mode(IntEnum):
    """FIFO_CTRL5.FIFO_MODE."""

    BYPASS = 0
    FIFO = 1
    CONTINUOUS_TO_FIFO = 3
    BYPASS_TO_CONTINUOUS = 4
    CONTINUOUS = 6


class Writer(Enum):
    """At what data sets are written; the values are the signals, where it is one."""

    DATA_READY = "of the faster sensor"
    STEP = "STEP_DETECTOR"
    HUB = "SENSORHUB"


class Fourth(Enum):
    """What the fourth data set holds."""

    HUB = 0
    TIMESTAMP = 1
    TEMPERATURE = 2


class Pattern:
    """Which sets are written at each trigger: set ``s`` at every ``decimations[s]``-th; the first writes all.

    ``period``: triggers until it repeats; ``length``: words of a period; ``widest``: words of the first one.
    """

    def __init__(self, decimations: tuple[int, ...]) -> None:
        self.period = lcm(*(every for every in decimations if every))
        self._sets = [
            tuple(number for number, every in enumerate(decimations) if every and trigger % every == 0)
            for trigger in range(self.period)
        ]
        self.length = SET_WORDS * sum(len(sets) for sets in self._sets)
        self.widest = SET_WORDS * len(self._sets[0])

    def sets(self, trigger: int) -> tuple[int, ...]:
        """The sets, from 0, of a trigger."""
        return self._sets[trigger % self.period]

    def words(self, trigger: int) -> int:
        """How many words a trigger writes."""
        return SET_WORDS * len(self.sets(trigger))


@dataclass(frozen=True)
class Layout:
    """What is stored and at which triggers; it may only change through bypass.

    ``odr_fifo``: its code, 0 where that is reserved; ``odr_sensors``: the registers' codes. How fast the
    sensors really run (inactivity slows them down by itself) is left to their streams.
    """

    decimations: tuple[int, ...]
    fourth: Fourth
    only_high: bool
    writer: Writer
    odr_fifo: int
    odr_sensors: tuple[int, int]


@dataclass(frozen=True)
class FifoSettings:
    """The FIFO's configuration; ``triggers``: the signals that switch a triggered mode over."""

    mode: Mode
    layout: Layout
    watermark: int
    depth: int
    triggers: frozenset[SignalName]
    on_pin: bool

    @classmethod
    def decode(cls, mem: bytearray) -> FifoSettings:
        """Read the settings out of the main register bank."""
        mode = FIFO_CTRL5.FIFO_MODE.get(mem[FIFO_CTRL5.addr])
        watermark = mem[FIFO_CTRL1.addr] | FIFO_CTRL2.FTH_10_8.get(mem[FIFO_CTRL2.addr]) << 8
        limited = bool(mem[FIFO_CTRL4.addr] & FIFO_CTRL4.STOP_ON_FTH.mask) and watermark > 0
        return cls(
            mode=Mode(mode) if mode in set(Mode) else Mode.BYPASS,
            layout=_layout(mem),
            watermark=watermark,
            depth=watermark if limited else WORDS,
            triggers=frozenset(name for name, address, mask in _TRIGGERS if mem[address] & mask),
            on_pin=bool(mem[INT1_CTRL.addr] & _INT1_FLAGS or mem[INT2_CTRL.addr] & _INT2_FLAGS),
        )


def violations(mem: bytearray) -> dict[str, bool]:
    """Every setting that cannot work, and whether it is present."""
    ctrl2, ctrl4, ctrl5 = mem[FIFO_CTRL2.addr], mem[FIFO_CTRL4.addr], mem[FIFO_CTRL5.addr]
    mode = FIFO_CTRL5.FIFO_MODE.get(ctrl5)
    on = mode != Mode.BYPASS
    decimations = _decimations(mem)
    both = FIFO_CTRL2.TIMER_PEDO_FIFO_EN.mask | FIFO_CTRL2.FIFO_TEMP_EN.mask
    bus = CTRL3_C.BDU.mask | CTRL3_C.IF_INC.mask
    unlimited = not mem[FIFO_CTRL1.addr] and not ctrl2 & FIFO_CTRL2.FTH_10_8.mask
    mixed = not decimations[0] or bool(decimations[1])
    return {
        f"FIFO_CTRL5.FIFO_MODE = {mode} is reserved": mode not in set(Mode),
        "FIFO_CTRL5.ODR_FIFO above 10": FIFO_CTRL5.ODR_FIFO.get(ctrl5) >= len(ODR_HZ),
        "FIFO_CTRL2.FIFO_TEMP_EN needs TIMER_PEDO_FIFO_EN = 0": on and ctrl2 & both == both,
        "FIFO_CTRL4.ONLY_HIGH_DATA needs the gyroscope's set and no accelerometer's": on
        and bool(ctrl4 & FIFO_CTRL4.ONLY_HIGH_DATA.mask)
        and mixed,
        "FIFO_CTRL4.STOP_ON_FTH needs a watermark": on
        and bool(ctrl4 & FIFO_CTRL4.STOP_ON_FTH.mask)
        and unlimited,
        "FIFO used without CTRL3_C.BDU and IF_INC": on and mem[CTRL3_C.addr] & bus != bus,
    }


def _decimations(mem: bytearray) -> tuple[int, ...]:
    ctrl3, ctrl4 = mem[FIFO_CTRL3.addr], mem[FIFO_CTRL4.addr]
    return (
        _DECIMATION[FIFO_CTRL3.DEC_FIFO_GYRO.get(ctrl3)],
        _DECIMATION[FIFO_CTRL3.DEC_FIFO_XL.get(ctrl3)],
        _DECIMATION[FIFO_CTRL4.DEC_DS3_FIFO.get(ctrl4)],
        _DECIMATION[FIFO_CTRL4.DEC_DS4_FIFO.get(ctrl4)],
    )


def _layout(mem: bytearray) -> Layout:
    odr_fifo = FIFO_CTRL5.ODR_FIFO.get(mem[FIFO_CTRL5.addr])
    return Layout(
        decimations=_decimations(mem),
        fourth=_fourth(mem[FIFO_CTRL2.addr]),
        only_high=bool(mem[FIFO_CTRL4.addr] & FIFO_CTRL4.ONLY_HIGH_DATA.mask),
        writer=_writer(mem),
        odr_fifo=odr_fifo if odr_fifo < len(ODR_HZ) else 0,
        odr_sensors=(CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]), CTRL2_G.ODR_G.get(mem[CTRL2_G.addr])),
    )


def _fourth(ctrl2: int) -> Fourth:
    if ctrl2 & FIFO_CTRL2.TIMER_PEDO_FIFO_EN.mask:
        return Fourth.TIMESTAMP
    return Fourth.TEMPERATURE if ctrl2 & FIFO_CTRL2.FIFO_TEMP_EN.mask else Fourth.HUB


def _writer(mem: bytearray) -> Writer:
    if mem[MASTER_CONFIG.addr] & MASTER_CONFIG.DATA_VALID_SEL_FIFO.mask:
        return Writer.HUB
    steps = mem[FIFO_CTRL2.addr] & FIFO_CTRL2.TIMER_PEDO_FIFO_DRDY.mask
    return Writer.STEP if steps else Writer.DATA_READY
