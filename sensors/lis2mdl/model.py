"""The LIS2MDL's behaviour behind its registers (datasheet DocID030621 Rev 3; application note AN5069 Rev 2).

Decisions where the documents are silent: a second MD = 01 while a single measurement is under way does not
restart it, and triggering one does not clear Zyxda (ST's own examples poll in such a loop); the per-axis
flags are cleared by their own high byte.
"""

from __future__ import annotations

from typing import ClassVar

from sensors.errors import to_int16
from sensors.lis2mdl import registers
from sensors.lis2mdl.errors import LIS2MDLErrors
from sensors.lis2mdl.magnetometer import MGAUSS_PER_LSB, Magnetometer, MagnetometerSettings
from sensors.lis2mdl.registers import (
    CFG_REG_A,
    CFG_REG_B,
    CFG_REG_C,
    OFFSET_X_REG,
    OFFSET_Y_REG,
    OFFSET_Z_REG,
    OUT,
    STATUS_REG,
    TEMP_OUT,
)
from sensors.output import DataReady, OutputWords
from sensors.part import Part, SelfClearingBits, Signal
from sensors.register import RegisterMap
from sensors.sampling import PS_PER_S, SampleStream, Times

_SOFT_RST_PS = 5 * PS_PER_S // 10**6  # datasheet 8.5
_REBOOT_PS = 20 * PS_PER_S // 10**3  # AN5069 section 7
_CONTINUOUS, _SINGLE, _IDLE = 0, 1, 3  # CFG_REG_A.MD; 2 is idle too
_TEMPERATURE_LSB_PER_DEGC = 8  # datasheet 8.16; 0 counts are 25 degC
_BURST_WRAP = {0x6D: 0x68}  # a burst over X, Y, Z starts again at X (sensor facts 2.1)
_DATA_READY = DataReady(
    STATUS_REG,
    words=(STATUS_REG.xda.mask, STATUS_REG.yda.mask, STATUS_REG.zda.mask),
    any=STATUS_REG.Zyxda.mask,
    overrun_shift=4,
)


class LIS2MDL(Part):
    """Magnetometer with thermometer; ``magnetic_field_mgauss``: (n, 3) in the sensor's own axes."""

    NAME: ClassVar[str] = "LIS2MDL"
    WHO_AM_I: ClassVar[int] = 0x40
    MAP: ClassVar[RegisterMap] = RegisterMap.of(registers)

    def __init__(
        self,
        magnetic_field_mgauss: Signal,
        temperature_degc: Signal,
        errors: LIS2MDLErrors | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(self.MAP, _BURST_WRAP)
        errors = errors or LIS2MDLErrors()
        self._magnetometer = Magnetometer(magnetic_field_mgauss, temperature_degc, errors, seed)
        self._temperature_degc = temperature_degc
        self._temperature_offset = errors.temperature_offset_degc
        self._mode = _IDLE
        main, mem = self.registers, self.registers.mem
        self._magnetometer.settings = MagnetometerSettings.decode(mem)
        self._mag = OutputWords(
            main, OUT, SampleStream(6, self._magnetometer.produce), _DATA_READY, self._after_sample
        )
        self._temp = OutputWords(main, TEMP_OUT, SampleStream(2, self._produce_temperature), None)
        self._clearing = SelfClearingBits(main, CFG_REG_A)
        main.before_read(STATUS_REG, self._refresh)
        main.before_read(CFG_REG_A, self._before_config)
        main.on_write(CFG_REG_A, self._write_config_a)
        for register in (CFG_REG_B, CFG_REG_C, OFFSET_X_REG, OFFSET_Y_REG, OFFSET_Z_REG):
            main.on_write(register, self._configure)

    def world_changed(self, now_ps: int | None = None) -> None:
        """The signals differ from what they were: samples still to come are computed anew."""
        del now_ps
        self._mag.stream.invalidate()
        self._temp.stream.invalidate()

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """``magnetic_field_mgauss`` or ``temperature_degc``."""
        lsb, zero = {
            "magnetic_field_mgauss": (MGAUSS_PER_LSB, 0.0),
            "temperature_degc": (1 / _TEMPERATURE_LSB_PER_DEGC, 25.0),
        }[channel]
        counts = 32768 if channel == "magnetic_field_mgauss" else 2048  # the thermometer has 12 bits
        return zero - counts * lsb, zero + (counts - 1) * lsb, lsb

    # -- data-ready -------------------------------------------------------------------------------------

    def _refresh(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._mag.refresh(now_ps)
        self._temp.refresh(now_ps)

    def _after_sample(self) -> None:
        if self._mode == _SINGLE:  # done: back to idle by itself (AN5069 3.3)
            mem = self.registers.mem
            self._mode = _IDLE
            mem[CFG_REG_A.addr] = CFG_REG_A.MD.put(mem[CFG_REG_A.addr], _IDLE)
            self._mag.stream.stop()

    # -- configuration ----------------------------------------------------------------------------------

    def _before_config(self, first: int, end: int, now_ps: int) -> None:
        self._refresh(first, end, now_ps)
        self._clearing.before_read(first, end, now_ps)

    def _write_config_a(self, old: int, new: int, now_ps: int) -> None:
        main = self.registers
        main.mem[CFG_REG_A.addr] = old  # a single measurement may have ended meanwhile: settle it first
        self._refresh(0, 0, now_ps)
        main.mem[CFG_REG_A.addr] = new
        reboot, reset = new & CFG_REG_A.REBOOT.mask, new & CFG_REG_A.SOFT_RST.mask
        if reboot and reset:
            main.note(now_ps, "forbidden", "CFG_REG_A: REBOOT and SOFT_RST at once")  # AN5069 section 7
        if reset:
            main.reset()
            for output in (self._mag, self._temp):
                output.reset()
            self._clearing.begin(CFG_REG_A.SOFT_RST.mask, now_ps + _SOFT_RST_PS)
        if reboot:
            main.mem[CFG_REG_A.addr] = CFG_REG_A.MD.put(main.mem[CFG_REG_A.addr], _IDLE)
            self._clearing.begin(CFG_REG_A.REBOOT.mask, now_ps + _REBOOT_PS)
        self._configure(old, new, now_ps)

    def _configure(self, old: int, new: int, now_ps: int) -> None:
        del old, new
        self._refresh(0, 0, now_ps)
        mem = self.registers.mem
        was, mode_was = self._magnetometer.settings, self._mode
        settings = self._magnetometer.settings = MagnetometerSettings.decode(mem)
        mode = CFG_REG_A.MD.get(mem[CFG_REG_A.addr])
        self._mode = _IDLE if mode > _SINGLE else mode
        control = mem[CFG_REG_C.addr]
        for output in (self._mag, self._temp):
            output.stream.invalidate()
            output.set_format(
                bdu=bool(control & CFG_REG_C.BDU.mask), big_endian=bool(control & CFG_REG_C.BLE.mask)
            )
        if self._mode != mode_was or (self._mode == _CONTINUOUS and settings.rate != was.rate):
            self._switch(settings, now_ps)
        elif self._mode == _CONTINUOUS:
            self._switch_temperature(settings, now_ps)

    def _switch(self, settings: MagnetometerSettings, now_ps: int) -> None:
        measuring = [self._mag.stream]
        if self.registers.mem[CFG_REG_A.addr] & CFG_REG_A.COMP_TEMP_EN.mask:
            measuring.append(self._temp.stream)
        for stream in (self._mag.stream, self._temp.stream):
            if self._mode == _IDLE or stream not in measuring:
                stream.stop()
            elif self._mode == _SINGLE:
                stream.start_single(now_ps, settings.turn_on_ps)
            else:
                stream.start(now_ps, settings.rate, settings.turn_on_ps)

    def _switch_temperature(self, settings: MagnetometerSettings, now_ps: int) -> None:
        """COMP_TEMP_EN written during continuous measurement; the temperature comes with the field."""
        on = bool(self.registers.mem[CFG_REG_A.addr] & CFG_REG_A.COMP_TEMP_EN.mask)
        if on and not self._temp.stream.running:
            self._temp.stream.start(now_ps, settings.rate, self._mag.stream.next_ps - now_ps)
        elif not on:
            self._temp.stream.stop()

    def _produce_temperature(self, number: int, t_s: Times) -> bytes:
        del number
        degc = self._temperature_degc(t_s) + self._temperature_offset
        return to_int16(((degc - 25.0) * _TEMPERATURE_LSB_PER_DEGC).clip(-2048, 2047)).tobytes()
