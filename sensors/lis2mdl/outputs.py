"""The LIS2MDL's output registers: field and temperature, their flags and format (AN5069 6.3 to 6.5)."""

from __future__ import annotations

from collections.abc import Callable

from sensors.lis2mdl.registers import CFG_REG_C, OUT, STATUS_REG, TEMP_OUT
from sensors.lis2mdl.streams import Streams
from sensors.output import DataReady, OutputWords
from sensors.register_file import RegisterFile

_DATA_READY = DataReady(
    STATUS_REG,
    words=(STATUS_REG.xda.mask, STATUS_REG.yda.mask, STATUS_REG.zda.mask),
    any=STATUS_REG.Zyxda.mask,
    overrun_shift=4,
)


class Outputs:
    """``after_sample()`` follows each look at a new sample of the field; the temperature has no flag."""

    def __init__(self, registers: RegisterFile, streams: Streams, after_sample: Callable[[], None]) -> None:
        self._mem = registers.mem
        self.field = OutputWords(registers, OUT, streams.field, _DATA_READY, after_sample)
        self._temperature = OutputWords(registers, TEMP_OUT, streams.temperature, None)

    def configure(self) -> None:
        """CFG_REG_C may have changed: BDU and BLE, the same for both."""
        control = self._mem[CFG_REG_C.addr]
        for output in (self.field, self._temperature):
            output.set_format(
                bdu=bool(control & CFG_REG_C.BDU.mask), big_endian=bool(control & CFG_REG_C.BLE.mask)
            )

    def refresh(self, now_ps: int) -> None:
        """Bring registers and flags up to date."""
        self.field.refresh(now_ps)
        self._temperature.refresh(now_ps)

    def reset(self) -> None:
        """SOFT_RST: both read 0 until the next sample."""
        self.field.reset()
        self._temperature.reset()
