"""The LPS22HB's pressure interrupt: reference, comparison and pin (datasheet 9.1 to 9.15, figure 22).

AUTOZERO and AUTORIFP store a sample in REF_P; the interrupt compares the pressure with REF_P. AUTOZERO also subtracts
REF_P, instead of RPDS, from the output.

Decisions where the datasheet is silent: the measured pressure is the pressure before RPDS is subtracted; the
sample that is stored in REF_P is already shown relative to REF_P; RESET_AZ clears REF_P and RESET_ARP does
not; a difference equal to the threshold sets neither flag; switching a comparison off clears its flag if the
flag is not latched.

Decisions: with INT_S = 0 the pin shows the enabled data signals ORed together, as in figure 22. Data-ready is P_DA.
"""

from __future__ import annotations

from fcu_emulator.sensors.lps22hb.registers import (
    CTRL_REG3,
    INT_SOURCE,
    INTERRUPT_CFG,
    REF_P,
    RPDS,
    STATUS,
    THS_P,
)
from fcu_emulator.sensors.pin import Pin

COUNTS_PER_SIXTEENTH = 256  # 1/16 hPa: one LSB of THS_P, and of RPDS (from AN4450, for the LPS25H)
_LOWEST, _HIGHEST = -(1 << 23), (1 << 23) - 1
_CAPTURE = INTERRUPT_CFG.AUTOZERO.mask | INTERRUPT_CFG.AUTORIFP.mask
_REF_P, _REF_P_END = REF_P.addr, REF_P.addr + REF_P.size


class Reference:
    """The reference. Pressures are counts, and samples have five bytes."""

    def __init__(self, mem: bytearray, rpds_counts_per_lsb: int) -> None:
        self._mem = mem
        self._rpds_counts_per_lsb = rpds_counts_per_lsb
        self._autozero = self._autorifp = False  # REF_P has been captured and the function is active
        self._subtracted = 0

    @property
    def capturing(self) -> bool:
        return bool(self._mem[INTERRUPT_CFG.addr] & _CAPTURE)

    def configure(self) -> None:
        rpds = int.from_bytes(self._mem[RPDS.addr : RPDS.addr + RPDS.size], "little", signed=True)
        self._subtracted = self._ref_p() if self._autozero else rpds * self._rpds_counts_per_lsb

    def take(self, sample: bytes) -> None:
        """Capture a sample if firmware has requested it."""
        asked = self._mem[INTERRUPT_CFG.addr] & _CAPTURE
        if not asked:
            return
        self._mem[_REF_P:_REF_P_END] = sample[:3]
        self._autozero = self._autozero or bool(asked & INTERRUPT_CFG.AUTOZERO.mask)
        self._autorifp = self._autorifp or bool(asked & INTERRUPT_CFG.AUTORIFP.mask)
        self._mem[INTERRUPT_CFG.addr] &= ~_CAPTURE
        self.configure()

    def output(self, sample: bytes) -> bytes:
        """Return the sample as the output registers show it."""
        if not self._subtracted:
            return sample
        counts = min(max(_pressure(sample) - self._subtracted, _LOWEST), _HIGHEST)
        return counts.to_bytes(3, "little", signed=True) + sample[3:]

    def difference(self, sample: bytes) -> int:
        """Return P_DIFF_IN, which the interrupt compares."""
        return _pressure(sample) - (self._ref_p() if self._autozero or self._autorifp else 0)

    def reset_autozero(self) -> None:
        """End AUTOZERO and clear REF_P (RESET_AZ)."""
        self._autozero = False
        self._mem[_REF_P:_REF_P_END] = bytes(REF_P.size)

    def reset_autorifp(self) -> None:
        self._autorifp = False

    def _ref_p(self) -> int:
        return int.from_bytes(self._mem[_REF_P:_REF_P_END], "little", signed=True)


def _pressure(sample: bytes) -> int:
    return int.from_bytes(sample[:3], "little", signed=True)


_PH, _PL, _IA = INT_SOURCE.PH.mask, INT_SOURCE.PL.mask, INT_SOURCE.IA.mask


class PressureInterrupt:
    """Comparison of samples with the threshold while ``on``; ``source``: flags PH, PL and IA."""

    def __init__(self) -> None:
        self.source = 0
        self.on = False
        self._latched = False
        self._enabled = 0
        self._threshold = 0

    @property
    def raised(self) -> bool:
        """Whether IA is set; IA also triggers the FIFO."""
        return self.source != 0

    def configure(self, mem: bytearray) -> None:
        control = mem[INTERRUPT_CFG.addr]
        self._threshold = COUNTS_PER_SIXTEENTH * int.from_bytes(mem[THS_P.addr : THS_P.addr + 2], "little")
        self._latched = bool(control & INTERRUPT_CFG.LIR.mask)
        self._enabled = 0
        if control & INTERRUPT_CFG.DIFF_EN.mask:
            self._enabled |= _PH if control & INTERRUPT_CFG.PHE.mask else 0
            self._enabled |= _PL if control & INTERRUPT_CFG.PLE.mask else 0
        self.on = self._enabled != 0
        if not self._latched:
            self._show(self.source & self._enabled)

    def compare(self, difference: int) -> None:
        found = 0
        if difference > self._threshold:
            found = _PH
        elif difference < -self._threshold:
            found = _PL
        self._show(found & self._enabled | (self.source if self._latched else 0))

    def acknowledge(self) -> None:
        if self._latched:
            self.source = 0

    def _show(self, flags: int) -> None:
        flags &= _PH | _PL
        self.source = flags | _IA if flags else 0


_INTERRUPTS = (0, _PH, _PL, _PH | _PL)  # by INT_S
_DATA = CTRL_REG3.F_FSS5.mask | CTRL_REG3.F_FTH.mask | CTRL_REG3.F_OVR.mask | CTRL_REG3.DRDY.mask


class IntDrdy:
    """The pin; ``routed``: whether any signal can change its level."""

    def __init__(self) -> None:
        self.pin = Pin("INT_DRDY")
        self.routed = False
        self._control = 0

    def configure(self, mem: bytearray) -> None:
        self._control = mem[CTRL_REG3.addr]
        self.routed = bool(self._control & (_DATA | CTRL_REG3.INT_S.mask))

    def drive(self, status: int, fifo_signals: int, int_source: int, at_ps: int) -> None:
        interrupts = _INTERRUPTS[CTRL_REG3.INT_S.get(self._control)]
        if interrupts:
            active = bool(int_source & interrupts)
        else:
            ready = CTRL_REG3.DRDY.mask if status & STATUS.P_DA.mask else 0
            active = bool(self._control & _DATA & (fifo_signals | ready))
        high = active != bool(self._control & CTRL_REG3.INT_H_L.mask)
        if high and self._control & CTRL_REG3.PP_OD.mask:
            self.pin.drive(None, at_ps)
        else:
            self.pin.drive(int(high), at_ps)
