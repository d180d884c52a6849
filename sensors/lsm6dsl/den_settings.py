"""What the registers say about data enable (datasheet 9.16 to 9.21; AN5040 Rev 3, 4.8)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from sensors.lsm6dsl.registers import CTRL4_C, CTRL5_C, CTRL6_C, CTRL8_XL, CTRL9_XL

_MODE_LSB = CTRL6_C.LVL2_EN.lsb


class Mode(IntEnum):
    """CTRL6_C: TRIG_EN, LVL1_EN, LVL2_EN."""

    OFF = 0b000
    LEVEL = 0b010
    LATCHED = 0b011
    EDGE = 0b100
    FIFO = 0b110


@dataclass(frozen=True)
class DenSettings:
    """``stamp_xl``: the accelerometer carries the stamp, not the gyroscope; ``axes``: which of X, Y, Z do."""

    mode: Mode
    active_high: bool
    gates_xl: bool
    stamp_xl: bool
    axes: tuple[bool, bool, bool]

    @classmethod
    def decode(cls, mem: bytearray) -> DenSettings:
        """Read the settings out of the main register bank; a mode that is none is off."""
        mode, control = _mode(mem), mem[CTRL9_XL.addr]
        return cls(
            mode=Mode(mode) if mode in set(Mode) else Mode.OFF,
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
        """Whether windows and marks of before no longer count."""
        return (self.mode, self.active_high, self.stamp_xl) != (old.mode, old.active_high, old.stamp_xl)


def violations(mem: bytearray) -> dict[str, bool]:
    """Every setting that cannot work, and whether it is present."""
    mode = _mode(mem)
    gates_xl = mode == Mode.EDGE and bool(mem[CTRL4_C.addr] & CTRL4_C.DEN_XL_EN.mask)
    return {
        f"CTRL6_C: TRIG_EN, LVL1_EN, LVL2_EN = {mode:03b}b is no data-enable mode": mode not in set(Mode),
        "CTRL4_C.DEN_XL_EN by edge needs CTRL8_XL.LPF2_XL_EN = 0": gates_xl
        and bool(mem[CTRL8_XL.addr] & CTRL8_XL.LPF2_XL_EN.mask),
    }


def _mode(mem: bytearray) -> int:
    return mem[CTRL6_C.addr] >> _MODE_LSB
