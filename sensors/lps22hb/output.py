"""Output registers and STATUS of the LPS22HB (datasheet 9.1 to 9.17).

With BDU, pressure and temperature do not change from the read of the first byte until the read of PRESS_OUT_H.
Decision: P_DA and T_DA are cleared by reading the high byte of their output, as in the LPS25H.
"""

from __future__ import annotations

from collections.abc import Callable

from fcu_emulator.sensors.lps22hb.fifo import PressureFifo
from fcu_emulator.sensors.lps22hb.interrupt import IntDrdy, PressureInterrupt, Reference
from fcu_emulator.sensors.lps22hb.registers import PRESS_OUT, STATUS, TEMP_OUT
from fcu_emulator.sensors.register_file import BurstReader, RegisterFile
from fcu_emulator.sensors.sampling import SampleStream
from fcu_emulator.sensors.shared_registers import bit, new_train


class Pipeline:
    """The path of a sample: reference, interrupt, FIFO and pin.

    ``every_sample``: whether one of these stages must process each sample.
    """

    def __init__(self, mem: bytearray, rpds_counts_per_lsb: int) -> None:
        self._mem = mem
        self.reference = Reference(mem, rpds_counts_per_lsb)
        self.interrupt = PressureInterrupt()
        self.fifo = PressureFifo()
        self.int_drdy = IntDrdy()
        self.every_sample = False

    def configure(self, now_ps: int) -> None:
        self.reference.configure()
        self.interrupt.configure(self._mem)
        self.fifo.configure(self._mem, triggered=self.interrupt.raised)
        self.int_drdy.configure(self._mem)
        self.every_sample = self._needs_every_sample()
        self.drive(now_ps)

    def take(self, sample: bytes, at_ps: int) -> bytes:
        """Process a measured sample; return the sample as the output registers show it."""
        if not self.every_sample:
            return self.reference.output(sample)
        self.reference.take(sample)
        output = self.reference.output(sample)
        if self.interrupt.on:
            self.interrupt.compare(self.reference.difference(sample))
            self.fifo.trigger(on=self.interrupt.raised)
        self.fifo.push(output)
        self.drive(at_ps)
        self.every_sample = self._needs_every_sample()
        return output

    def level_was_read(self, now_ps: int) -> None:
        self.fifo.pop()
        self.drive(now_ps)

    def int_source_was_read(self, now_ps: int) -> None:
        """Clear a latched interrupt and its effects on FIFO and pin."""
        self.interrupt.acknowledge()
        self.fifo.trigger(on=self.interrupt.raised)
        self.drive(now_ps)

    def drive(self, at_ps: int) -> None:
        self.int_drdy.drive(self._mem[STATUS.addr], self.fifo.signals(), self.interrupt.source, at_ps)

    def reset(self) -> None:
        """Reset after SWRESET; the caller must then call ``configure``."""
        self.reference.reset_autozero()
        self.reference.reset_autorifp()

    def _needs_every_sample(self) -> bool:
        watching = self.interrupt.on or self.fifo.active or self.int_drdy.routed
        return watching or self.reference.capturing


_NEW, _OVERRUN_SHIFT = STATUS.P_DA.mask | STATUS.T_DA.mask, 4
_FIRST, _END = PRESS_OUT.addr, TEMP_OUT.addr + TEMP_OUT.size
P_READ = 0xFF & ~(STATUS.P_DA.mask | STATUS.P_OR.mask)
_T_READ = 0xFF & ~(STATUS.T_DA.mask | STATUS.T_OR.mask)
_PRESS_OUT_H, _TEMP_OUT_H = PRESS_OUT.addr + 2, TEMP_OUT.addr + 1


_HELD = sum(bit(address) for address in range(_FIRST, _END))


class PressureOutput:
    """The output registers.

    ``latest``: the latest sample, five bytes; ``stale``: whether the next read must update the registers.
    """

    def __init__(self, registers: RegisterFile, latest: bytes) -> None:
        self._mem = registers.mem
        self._held = registers.held
        self._version = registers.version
        self.latest = latest
        self.stale = True
        self.bdu = False

    @property
    def held(self) -> bool:
        """Whether BDU holds the output."""
        return bool(self._held[0])

    def set_bdu(self, *, on: bool) -> None:
        """Set BDU; if BDU is off, the output is released."""
        self.bdu = on
        if not on:
            self._hold(on=False)
        self.stale = True

    def flag(self, fresh: int) -> None:
        unread = _NEW if fresh > 1 else self._mem[STATUS.addr] & _NEW
        self._mem[STATUS.addr] |= _NEW | unread << _OVERRUN_SHIFT

    def show(self, sample: bytes | None) -> None:
        """Write ``sample``, if any, unless the output is held."""
        self.stale = self.held
        if sample is not None and not self.held:
            self._mem[_FIRST:_END] = sample

    def account(self, first: int, end: int) -> bool:
        """Apply the effects of a read of one output; return whether the read clears P_DA."""
        if first <= _PRESS_OUT_H < end:
            self._mem[STATUS.addr] &= P_READ
            self._hold(on=False)
            return True
        if first < _PRESS_OUT_H:
            self._hold(on=self.bdu)
        elif end > _TEMP_OUT_H:
            self._mem[STATUS.addr] &= _T_READ
        return False

    def _hold(self, *, on: bool) -> None:
        if on != self.held:
            self._held[0] = _HELD if on else 0
            self._version[0] += 1


class OutputTrain:
    """Train of output samples for C while FIFO and pin are unused; ``refresh(now_ps)`` processes due samples."""

    def __init__(
        self,
        registers: RegisterFile,
        output: PressureOutput,
        stream: SampleStream,
        pipeline: Pipeline,
        refresh: Callable[[int], None],
    ) -> None:
        self._registers = registers
        self._mem = registers.mem
        self._output = output
        self._stream = stream
        self._pipeline = pipeline
        self._refresh = refresh
        keep = bytearray(b"\xff" * (_END - _FIRST))
        keep[_PRESS_OUT_H - _FIRST], keep[_TEMP_OUT_H - _FIRST] = P_READ, _T_READ
        self._train_bytes, self.train = new_train(_FIRST, bytes(keep))
        self.train.status = STATUS.addr

    def fill(self, now_ps: int) -> None:
        """Put the current sample into the shared train."""
        output, version = self._output, self._registers.version[0]
        if now_ps >= self._stream.next_ps or output.stale:
            self._refresh(now_ps)
        if not self._alone():
            self.train.read_live(version)
            return
        held = _HELD if output.bdu else 0
        self.train.set_effects((held, held, 0, 0, 0), (0, 0, held, 0, 0))
        self.train.fill(version, output.latest, [self._stream.next_ps], stale=output.stale)

    def take_back(self) -> None:
        """End the shared train."""
        self.train.take_back()

    def burst_reader(self, first: int, end: int) -> BurstReader | None:
        return self._read_pressure if (first, end) == (_FIRST, _PRESS_OUT_H + 1) else None

    def _read_pressure(self, now_ps: int) -> tuple[bytes, int]:
        output, stream = self._output, self._stream
        if now_ps >= stream.next_ps or output.stale:
            self._refresh(now_ps)
        if output.held or not self._alone():
            return self._registers.read(_FIRST, _PRESS_OUT_H + 1 - _FIRST, now_ps), 0
        self._mem[STATUS.addr] &= P_READ
        return bytes(self._mem[_FIRST : _PRESS_OUT_H + 1]), stream.next_ps

    def _alone(self) -> bool:
        pipeline = self._pipeline
        return not (pipeline.fifo.active or pipeline.int_drdy.routed)
