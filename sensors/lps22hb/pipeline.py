"""What the LPS22HB does with a sample once it is measured, in this order: reference, interrupt, FIFO, pin."""

from __future__ import annotations

from sensors.lps22hb.fifo import Fifo
from sensors.lps22hb.int_drdy import IntDrdy
from sensors.lps22hb.interrupt import PressureInterrupt
from sensors.lps22hb.reference import Reference
from sensors.lps22hb.registers import STATUS


class Pipeline:
    """The functions beyond plain measuring, on ``mem``, the part's registers.

    ``every_sample``: whether any of them looks at each sample; if none does, only the latest one matters.
    """

    def __init__(self, mem: bytearray, rpds_counts_per_lsb: int) -> None:
        self._mem = mem
        self.reference = Reference(mem, rpds_counts_per_lsb)
        self.interrupt = PressureInterrupt()
        self.fifo = Fifo()
        self.int_drdy = IntDrdy()
        self.every_sample = False

    def configure(self, now_ps: int) -> None:
        """The registers may have changed."""
        self.reference.configure()
        self.interrupt.configure(self._mem)
        self.fifo.configure(self._mem, triggered=self.interrupt.raised)
        self.int_drdy.configure(self._mem)
        self.every_sample = self._looks_at_every_sample()
        self.drive(now_ps)

    def take(self, sample: bytes, at_ps: int) -> bytes:
        """A measured sample has come, and STATUS says so; as the output registers show it."""
        if not self.every_sample:
            return self.reference.output(sample)
        self.reference.take(sample)
        output = self.reference.output(sample)
        if self.interrupt.on:
            self.interrupt.compare(self.reference.difference(sample))
            self.fifo.trigger(on=self.interrupt.raised)
        self.fifo.push(output)
        self.drive(at_ps)
        self.every_sample = self._looks_at_every_sample()
        return output

    def level_was_read(self, now_ps: int) -> None:
        """The last byte of the FIFO's oldest level has been read."""
        self.fifo.pop()
        self.drive(now_ps)

    def int_source_was_read(self, now_ps: int) -> None:
        """A latched interrupt ends, and with it what it triggered."""
        self.interrupt.acknowledge()
        self.fifo.trigger(on=self.interrupt.raised)
        self.drive(now_ps)

    def drive(self, at_ps: int) -> None:
        """Bring the pin in line as of ``at_ps``."""
        self.int_drdy.drive(self._mem[STATUS.addr], self.fifo.signals(), self.interrupt.source, at_ps)

    def reset(self) -> None:
        """SWRESET has reset the registers; ``configure`` follows."""
        self.reference.reset_autozero()
        self.reference.reset_autorifp()

    def _looks_at_every_sample(self) -> bool:
        watching = self.interrupt.on or self.fifo.active or self.int_drdy.routed
        return watching or self.reference.capturing
