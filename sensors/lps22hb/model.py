"""The LPS22HB's behaviour behind its registers.

Decisions where the datasheet is silent: while the FIFO is on and empty, the output registers do not change; RESET_AZ,
RESET_ARP and SWRESET act immediately and read 1 for 10 us; SWRESET keeps RPDS and RES_CONF; a write of ONE_SHOT during
a measurement has no effect; a new rate aborts the measurement; BOOT takes one period, or 1 ms in power-down; BOOT
changes no setting, and registers work during BOOT.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from fcu_emulator.sensors.declaration import Bus, Function, Quantity, Wires
from fcu_emulator.sensors.errors import PartErrors
from fcu_emulator.sensors.lps22hb import registers
from fcu_emulator.sensors.lps22hb.barometer import (
    COUNTS_PER_DEGC,
    COUNTS_PER_HPA,
    Barometer,
    BarometerSettings,
    supply_current_ua,
)
from fcu_emulator.sensors.lps22hb.declaration import BUS, FUNCTIONS, SIGNALS, LPS22HBErrors
from fcu_emulator.sensors.lps22hb.interrupt import COUNTS_PER_SIXTEENTH
from fcu_emulator.sensors.lps22hb.output import P_READ, OutputTrain, Pipeline, PressureOutput
from fcu_emulator.sensors.lps22hb.registers import (
    CTRL_REG1,
    CTRL_REG2,
    CTRL_REG3,
    FIFO_CTRL,
    FIFO_STATUS,
    INT_SOURCE,
    INTERRUPT_CFG,
    LPFP_RES,
    PRESS_OUT,
    REF_P,
    RES_CONF,
    RPDS,
    STATUS,
    TEMP_OUT,
    THS_P,
)
from fcu_emulator.sensors.part import SelfClearingBits, Sensor, Signal, Write
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register import RegisterMap
from fcu_emulator.sensors.register_file import NEVER_PS, RegisterFile
from fcu_emulator.sensors.sampling import PS_PER_S

_RESET_PS = 10 * PS_PER_S // 10**6
_BOOT_PS = PS_PER_S // 10**3
_RESET_BY_SWRESET = (INTERRUPT_CFG, THS_P, CTRL_REG1, CTRL_REG2, CTRL_REG3, FIFO_CTRL, REF_P)
_BOOT, _SWRESET, _ONE_SHOT = CTRL_REG2.BOOT.mask, CTRL_REG2.SWRESET.mask, CTRL_REG2.ONE_SHOT.mask


class Commands:
    """Handlers of command bits in ``registers``; each calls ``configure(now_ps)`` at the end."""

    def __init__(
        self,
        registers: RegisterFile,
        barometer: Barometer,
        pipeline: Pipeline,
        configure: Callable[[int], None],
    ) -> None:
        self._one_shot = False
        self._registers = registers
        self._barometer = barometer
        self._pipeline = pipeline
        self._configure = configure
        self._clearing = SelfClearingBits(registers, CTRL_REG2)
        self._clearing_resets = SelfClearingBits(registers, INTERRUPT_CFG)

    def before_control2(self, first: int, end: int, now_ps: int) -> None:
        self._clearing.before_read(first, end, now_ps)

    def before_interrupt_cfg(self, first: int, end: int, now_ps: int) -> None:
        self._clearing_resets.before_read(first, end, now_ps)

    def booting(self, now_ps: int) -> bool:
        return self._clearing.pending(_BOOT, now_ps)

    def write_interrupt_cfg(self, old: int, new: int, now_ps: int) -> None:
        del old
        if new & INTERRUPT_CFG.RESET_AZ.mask:
            self._pipeline.reference.reset_autozero()
        if new & INTERRUPT_CFG.RESET_ARP.mask:
            self._pipeline.reference.reset_autorifp()
        resets = new & (INTERRUPT_CFG.RESET_AZ.mask | INTERRUPT_CFG.RESET_ARP.mask)
        if resets:
            self._clearing_resets.begin(resets, now_ps + _RESET_PS)
        self._configure(now_ps)

    def write_control2(self, old: int, new: int, now_ps: int) -> None:
        del old
        mem, busy = self._registers.mem, self._one_shot
        if busy:
            mem[CTRL_REG2.addr] |= _ONE_SHOT
        if new & _SWRESET:
            self.end_one_shot()
            self._registers.reset(*_RESET_BY_SWRESET)
            self._pipeline.reset()
            self._clearing.begin(_SWRESET, now_ps + _RESET_PS)
        self._configure(now_ps)
        if new & _BOOT:
            rate = self._barometer.settings.rate
            self._clearing.begin(_BOOT, now_ps + (int(PS_PER_S / rate) if rate else _BOOT_PS))
        if mem[CTRL_REG2.addr] & _ONE_SHOT and not busy:
            self._start_one_shot(now_ps)

    def end_one_shot(self) -> None:
        if self._one_shot:
            self._one_shot = False
            self._registers.mem[CTRL_REG2.addr] &= ~_ONE_SHOT
            self._barometer.stream.stop()

    def _start_one_shot(self, now_ps: int) -> None:
        mem = self._registers.mem
        if CTRL_REG1.ODR.get(mem[CTRL_REG1.addr]):
            self._registers.note(
                now_ps, "forbidden", "one-shot-while-on", "CTRL_REG2.ONE_SHOT while CTRL_REG1.ODR is not 0"
            )
            mem[CTRL_REG2.addr] &= ~_ONE_SHOT
            return
        self._one_shot = True
        self._barometer.measure_once(now_ps)


TRIMMING_PS = 5 * PS_PER_S // 10**3  # an assumption; the datasheet gives no figure
_TEMP_OUT_H = TEMP_OUT.addr + 1
_BURST_WRAP = {_TEMP_OUT_H: PRESS_OUT.addr}  # a burst wraps within the output (datasheet 5.8)


class LPS22HB(Sensor):
    """Barometer with thermometer; ``pressure_hpa`` and ``temperature_degc``: (n,).

    ``rpds_counts_per_lsb``: 256, or 1 as in ST's driver; ``powered_on_ps``: None if already started; ``trimming_ps``:
    duration of BOOT_STATUS after power-on; ``power_on_counts``: PRESS_OUT before the first sample (0x2F6666 was seen).
    """

    NAME: ClassVar[str] = "LPS22HB"
    WHO_AM_I: ClassVar[int] = 0xB1
    MAP: ClassVar[RegisterMap] = RegisterMap.of(registers)
    SIGNALS: ClassVar[tuple[Quantity, ...]] = SIGNALS
    BUS: ClassVar[Bus] = BUS
    ERRORS: ClassVar[type[PartErrors]] = LPS22HBErrors
    FUNCTIONS: ClassVar[tuple[Function, ...]] = FUNCTIONS

    def __init__(
        self,
        pressure_hpa: Signal,
        temperature_degc: Signal,
        errors: LPS22HBErrors | None = None,
        seed: int = 0,
        *,
        rpds_counts_per_lsb: int = COUNTS_PER_SIXTEENTH,
        powered_on_ps: int | None = None,
        trimming_ps: int = TRIMMING_PS,
        power_on_counts: int = 0,
    ) -> None:
        super().__init__(self.MAP, _BURST_WRAP)
        main = self.registers
        self._barometer = Barometer(pressure_hpa, temperature_degc, errors or LPS22HBErrors(), seed)
        self._stream = self._barometer.stream
        self.streams = (self._stream,)
        self._pipeline = Pipeline(main.mem, rpds_counts_per_lsb)
        at_power_on = power_on_counts.to_bytes(PRESS_OUT.size, "little", signed=True) + bytes(TEMP_OUT.size)
        self._output = PressureOutput(main, at_power_on)
        self._trimmed_ps = 0 if powered_on_ps is None else powered_on_ps + trimming_ps
        self._inside = True
        self._commands = Commands(main, self._barometer, self._pipeline, self._configure)
        self._wire(main)

    def pins(self) -> tuple[Pin, ...]:
        return (self._pipeline.int_drdy.pin,)

    def catch_up(self, now_ps: int) -> None:
        self._refresh(now_ps)

    def next_event_ps(self) -> int:
        """Return the time at which the next sample can change the pin."""
        int_drdy = self._pipeline.int_drdy
        return self._stream.next_ps if int_drdy.routed and int_drdy.pin.wired else NEVER_PS

    def spi_wires(self) -> Wires:
        return 3 if self.registers.mem[CTRL_REG1.addr] & CTRL_REG1.SIM.mask else 4

    def supply_current_ua(self) -> float:
        return supply_current_ua(self._barometer.settings)

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """Return the specified range of a channel."""
        return {
            "pressure_hpa": (260.0, 1260.0, 1 / COUNTS_PER_HPA),
            "temperature_degc": (-327.68, 327.67, 1 / COUNTS_PER_DEGC),
        }[channel]

    # -- wiring -----------------------------------------------------------------------------------------

    def _writer(self, registers: RegisterFile) -> Write:
        def settle_and_write(address: int, data: bytes, now_ps: int) -> None:
            self._refresh(now_ps)
            registers.write(address, data, now_ps)

        return settle_and_write

    def _wire(self, main: RegisterFile) -> None:
        main.set_status(STATUS, self._before_settled)
        main.before_read(REF_P, self._before_settled)
        main.before_read(INTERRUPT_CFG, self._before_interrupt_cfg)
        main.before_read(CTRL_REG2, self._before_control2)
        main.before_read(INT_SOURCE, self._before_int_source)
        main.after_read(INT_SOURCE, self._after_int_source)
        main.before_read(FIFO_STATUS, self._before_fifo_status)
        main.before_read(PRESS_OUT, self._before_output)
        main.before_read(TEMP_OUT, self._before_output)
        main.after_read(TEMP_OUT, self._after_temperature)
        train = OutputTrain(main, self._output, self._stream, self._pipeline, self._refresh)
        pressure = PRESS_OUT, self._before_output, None
        main.add_output(train, pressure, (TEMP_OUT, self._before_output, self._after_temperature))
        main.before_read(LPFP_RES, self._before_lpfp_res)
        for register in (THS_P, CTRL_REG3, REF_P, RPDS):
            main.on_write(register, self._write_plain)
        main.on_write(INTERRUPT_CFG, self._commands.write_interrupt_cfg)
        main.on_write(CTRL_REG1, self._write_control1)
        main.on_write(CTRL_REG2, self._commands.write_control2)
        main.on_write(FIFO_CTRL, self._write_fifo_ctrl)
        main.on_write(RES_CONF, self._write_res_conf)

    # -- samples and reading ----------------------------------------------------------------------------

    def _refresh(self, now_ps: int) -> None:
        stream, pipeline, output = self._stream, self._pipeline, self._output
        while now_ps >= stream.next_ps:
            at_ps = stream.next_ps if pipeline.every_sample else now_ps
            output.flag(stream.advance(at_ps))
            self._commands.end_one_shot()
            self._check_range(stream.data, at_ps)
            output.latest = pipeline.take(stream.data, at_ps)
        output.show(pipeline.fifo.oldest if pipeline.fifo.on else output.latest)

    def _check_range(self, sample: bytes, at_ps: int) -> None:
        """Report a sample outside the specified range; the documents do not say what a real sensor measures there."""
        hpa = int.from_bytes(sample[: PRESS_OUT.size], "little", signed=True) / COUNTS_PER_HPA
        low, high, _ = self.sample_range("pressure_hpa")
        was_inside, self._inside = self._inside, low <= hpa <= high
        if was_inside and not self._inside:
            self.registers.note(
                at_ps,
                "out of range",
                "pressure-range",
                f"{hpa:.0f} hPa; the sensor is specified from {low:.0f} to {high:.0f} hPa",
                hpa=hpa,
                min_hpa=low,
                max_hpa=high,
            )

    def _before_settled(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._refresh(now_ps)

    def _before_output(self, first: int, end: int, now_ps: int) -> None:
        output = self._output
        if now_ps >= self._stream.next_ps or output.stale:
            self._refresh(now_ps)
        if end - first == PRESS_OUT.size and not output.held:  # the usual read of the whole pressure
            self.registers.mem[STATUS.addr] &= P_READ
        elif not output.account(first, end):
            return
        if self._pipeline.int_drdy.routed:
            self._pipeline.drive(now_ps)

    def _after_temperature(self, first: int, end: int, now_ps: int) -> None:
        del first
        if end > _TEMP_OUT_H and self._pipeline.fifo.on:
            self._pipeline.level_was_read(now_ps)
            self._output.stale = True

    def _before_int_source(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._refresh(now_ps)
        booting = now_ps < self._trimmed_ps or self._commands.booting(now_ps)
        boot_status = INT_SOURCE.BOOT_STATUS.mask if booting else 0
        self.registers.mem[INT_SOURCE.addr] = self._pipeline.interrupt.source | boot_status

    def _after_int_source(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._pipeline.int_source_was_read(now_ps)
        self._output.stale = True

    def _before_fifo_status(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._refresh(now_ps)
        self.registers.mem[FIFO_STATUS.addr] = self._pipeline.fifo.status()

    def _before_lpfp_res(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._refresh(now_ps)
        self._barometer.restart_filter()

    def _before_interrupt_cfg(self, first: int, end: int, now_ps: int) -> None:
        self._refresh(now_ps)
        self._commands.before_interrupt_cfg(first, end, now_ps)

    def _before_control2(self, first: int, end: int, now_ps: int) -> None:
        self._refresh(now_ps)
        self._commands.before_control2(first, end, now_ps)

    # -- writing ----------------------------------------------------------------------------------------

    def _write_plain(self, old: int, new: int, now_ps: int) -> None:
        del old, new
        self._configure(now_ps)

    def _configure(self, now_ps: int) -> None:
        mem = self.registers.mem
        self._barometer.configure(BarometerSettings.decode(mem), now_ps)
        self._pipeline.configure(now_ps)
        self._output.set_bdu(on=bool(mem[CTRL_REG1.addr] & CTRL_REG1.BDU.mask))
        self.registers.increment = bool(mem[CTRL_REG2.addr] & CTRL_REG2.IF_ADD_INC.mask)
        self.i2c_off = bool(mem[CTRL_REG2.addr] & CTRL_REG2.I2C_DIS.mask)

    def _write_control1(self, old: int, new: int, now_ps: int) -> None:
        if CTRL_REG1.ODR.get(new) > 5 >= CTRL_REG1.ODR.get(old):
            self.registers.note(now_ps, "forbidden", "reserved-rate", "CTRL_REG1.ODR above 5")
        if CTRL_REG1.ODR.get(new):
            self._commands.end_one_shot()
        self._configure(now_ps)

    def _write_fifo_ctrl(self, old: int, new: int, now_ps: int) -> None:
        if FIFO_CTRL.F_MODE.get(new) == 0b101 != FIFO_CTRL.F_MODE.get(old):
            self.registers.note(now_ps, "forbidden", "reserved-fifo-mode", "FIFO_CTRL.F_MODE = 101b")
        self._configure(now_ps)

    def _write_res_conf(self, old: int, new: int, now_ps: int) -> None:
        if old != new and self._stream.running:
            self.registers.note(
                now_ps, "forbidden", "changed-while-on", "RES_CONF.LC_EN changed outside power-down"
            )
        self._configure(now_ps)
