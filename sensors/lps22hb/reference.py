"""The pressure the LPS22HB's output and interrupt refer to: RPDS, REF_P, AUTOZERO, AUTORIFP (datasheet 9.1).

AUTOZERO and AUTORIFP both copy the next measured pressure to REF_P and then clear their bit. From that sample
on AUTOZERO subtracts REF_P from the output, in place of RPDS; AUTORIFP leaves the output alone. Under either
the interrupt compares the measured pressure with REF_P, without them with 0.

Decisions where the datasheet is silent: the measured pressure is the one before RPDS; the sample that is
captured is itself shown relative already, so that a driver which waits for AUTOZERO to clear reads 0;
firmware may overwrite REF_P, and the next sample refers to that; RESET_AZ clears REF_P and RESET_ARP does
not; the functions do not exclude each other.
"""

from __future__ import annotations

from sensors.lps22hb.registers import INTERRUPT_CFG, REF_P, RPDS

RPDS_COUNTS_PER_LSB = 256  # 1/16 hPa; ST's board driver would have 1 count (sensor facts DIS-15)
_LOWEST, _HIGHEST = -(1 << 23), (1 << 23) - 1
_CAPTURE = INTERRUPT_CFG.AUTOZERO.mask | INTERRUPT_CFG.AUTORIFP.mask
_REF_P, _REF_P_END = REF_P.addr, REF_P.addr + REF_P.size


class Reference:
    """Works on ``mem``, the part's registers; pressures are counts, samples the stream's five bytes."""

    def __init__(self, mem: bytearray, rpds_counts_per_lsb: int) -> None:
        self._mem = mem
        self._rpds_counts_per_lsb = rpds_counts_per_lsb
        self._autozero = self._autorifp = False  # captured, and in force since
        self._subtracted = 0

    @property
    def capturing(self) -> bool:
        """Whether the next sample will be captured."""
        return bool(self._mem[INTERRUPT_CFG.addr] & _CAPTURE)

    def configure(self) -> None:
        """RPDS or REF_P may have changed."""
        rpds = int.from_bytes(self._mem[RPDS.addr : RPDS.addr + RPDS.size], "little", signed=True)
        self._subtracted = self._ref_p() if self._autozero else rpds * self._rpds_counts_per_lsb

    def take(self, sample: bytes) -> None:
        """A sample has come: capture it where firmware has asked for that."""
        asked = self._mem[INTERRUPT_CFG.addr] & _CAPTURE
        if not asked:
            return
        self._mem[_REF_P:_REF_P_END] = sample[:3]
        self._autozero = self._autozero or bool(asked & INTERRUPT_CFG.AUTOZERO.mask)
        self._autorifp = self._autorifp or bool(asked & INTERRUPT_CFG.AUTORIFP.mask)
        self._mem[INTERRUPT_CFG.addr] &= ~_CAPTURE
        self.configure()

    def output(self, sample: bytes) -> bytes:
        """The sample as the output registers and the FIFO show it."""
        if not self._subtracted:
            return sample
        counts = min(max(_pressure(sample) - self._subtracted, _LOWEST), _HIGHEST)
        return counts.to_bytes(3, "little", signed=True) + sample[3:]

    def difference(self, sample: bytes) -> int:
        """P_DIFF_IN, what the interrupt compares."""
        return _pressure(sample) - (self._ref_p() if self._autozero or self._autorifp else 0)

    def reset_autozero(self) -> None:
        """RESET_AZ: back to normal, REF_P cleared."""
        self._autozero = False
        self._mem[_REF_P:_REF_P_END] = bytes(REF_P.size)

    def reset_autorifp(self) -> None:
        """RESET_ARP: back to normal."""
        self._autorifp = False

    def _ref_p(self) -> int:
        return int.from_bytes(self._mem[_REF_P:_REF_P_END], "little", signed=True)


def _pressure(sample: bytes) -> int:
    return int.from_bytes(sample[:3], "little", signed=True)
