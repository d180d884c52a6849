"""ADC1: timed regular conversions (RM0368 section 11), and the board's voltages.

Continuous conversion of one channel without DMA or interrupt pauses at EOC. A read of DR then
converts the voltage that is present at this time. An unconnected input reads 0 V. Notes report
injected channels, triggers, analog watchdog and discontinuous mode as not modelled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, InterruptInput, Peripheral, Soc
from fcu_emulator.emulator.chip.registers import DECLARED, adc
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.clock import PS_PER_S, Event

# -- voltages (RM0368 11.9, 11.10) --------------------------------------------------------------------------

Volts: TypeAlias = Callable[[], float]

VDDA_V = 3.3
FULL_SCALE = 4095

_BATTERY_CHANNEL, _VREFINT_CHANNEL = 9, 17
_TEMPERATURE_CHANNELS, _VBAT_CHANNEL = (16, 18), 18
"""The STM32F401 has its temperature sensor on both channels; ST's HAL for this chip converts channel 16."""
_VREFINT_V = 1.21  # STM32F401xB/C datasheet: 1.18 to 1.24 V
_V25_V, _SLOPE_V_PER_DEGC = 0.76, 0.0025
_DIVIDER = 20 / 30  # 10k over 20k (steval_fcu001_v1.h of STSW-FCU001)


class AdcInputs:
    """Input voltages of the channels, including the battery voltage."""

    def __init__(self, battery_v: float = 3.7, die_degc: float = 30.0) -> None:
        self.battery_v = battery_v
        self.die_degc = die_degc
        self._pins: dict[int, Volts] = {_BATTERY_CHANNEL: lambda: self.battery_v * _DIVIDER}

    def connect(self, channel: int, volts: Volts) -> None:
        """Connect one of the inputs 0 to 15 to a voltage."""
        self._pins[channel] = volts

    def sample(self, channel: int, *, sensors: bool, vbat: bool) -> int:
        """Return a 12-bit result. ``sensors`` is CCR.TSVREFE; ``vbat`` is CCR.VBATE.

        CCR.VBATE connects a quarter of the backup supply to channel 18.
        """
        code = round(self._volts(channel, sensors, vbat) / VDDA_V * FULL_SCALE)
        return min(max(code, 0), FULL_SCALE)

    def _volts(self, channel: int, sensors: bool, vbat: bool) -> float:
        if channel == _VREFINT_CHANNEL:
            return _VREFINT_V if sensors else 0.0
        if channel == _VBAT_CHANNEL and vbat:
            return VDDA_V / 4
        if channel in _TEMPERATURE_CHANNELS:
            return _V25_V + _SLOPE_V_PER_DEGC * (self.die_degc - 25) if sensors else 0.0
        source = self._pins.get(channel)
        return 0.0 if source is None else source()


# -- the converter ------------------------------------------------------------------------------------------

SR, CR1, CR2, SMPR1, SMPR2 = offsets(adc.SR, adc.CR1, adc.CR2, adc.SMPR1, adc.SMPR2)
SQR1, SQR2, SQR3, DR, CCR = offsets(adc.SQR1, adc.SQR2, adc.SQR3, adc.DR, adc.CCR)

_EOC, _STRT, _OVR = masks(adc.SR.EOC, adc.SR.STRT, adc.SR.OVR)
_EOCIE, _SCAN, _OVRIE = masks(adc.CR1.EOCIE, adc.CR1.SCAN, adc.CR1.OVRIE)
_CR1_NOT_MODELLED = sum(masks(adc.CR1.AWDIE, adc.CR1.JEOCIE, adc.CR1.DISCEN, adc.CR1.AWDEN, adc.CR1.JAWDEN))
_ADON, _CONT, _DMA, _DDS = masks(adc.CR2.ADON, adc.CR2.CONT, adc.CR2.DMA, adc.CR2.DDS)
_EOCS, _ALIGN, _SWSTART = masks(adc.CR2.EOCS, adc.CR2.ALIGN, adc.CR2.SWSTART)
_TRIGGERS = adc.CR2.EXTEN.mask | adc.CR2.JEXTEN.mask
_TSVREFE, _VBATE = masks(adc.CCR.TSVREFE, adc.CCR.VBATE)
_SAMPLING_CYCLES = (3, 15, 28, 56, 84, 112, 144, 480)
_RESOLUTION_BITS = (12, 10, 8, 6)


class Adc(Peripheral, declared=DECLARED["ADC1"]):
    """ADC1 and the common registers."""

    def __init__(self, soc: Soc, name: str, base: int, irq: InterruptInput, inputs: AdcInputs) -> None:
        super().__init__(soc, name, base)
        self.inputs = inputs
        self._irq = irq
        self._event: Event | None = None
        self._rank = 0  # index of the current conversion in the sequence
        self._paused = False
        self._wants_dma = True

    def reset(self) -> None:
        super().reset()
        self._stop()
        self._wants_dma = True
        self._signal()

    # -- registers --------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        if offset != DR:
            return super().read(offset)
        if self._paused:
            self._convert()
            self._paused = False
            self._begin()
        self.registers[SR] &= ~_EOC
        self._signal()
        return self.registers[DR]

    def pure_read(self, offset: int) -> bool:
        return offset != DR

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        super().write(offset, value, mask)
        value &= mask
        if offset == SR:
            self.registers[SR] &= value | ~mask
            if self._paused and not self.registers[SR] & _EOC:
                self._paused = False
                self._begin()
        elif offset == CR2:
            self._control(value)
        elif offset == CR1 and value & _CR1_NOT_MODELLED:
            self.note(
                "not modelled",
                "watchdog-or-injected",
                "CR1: analog watchdog, injected channels, discontinuous mode",
            )
        self._signal()

    def _control(self, value: int) -> None:
        cr2 = self.registers[CR2]
        if cr2 & _TRIGGERS or value & adc.CR2.JSWSTART.mask:
            self.note("not modelled", "external-trigger", "CR2: external triggers and injected conversions")
        if not cr2 & _DMA:
            self._wants_dma = True  # firmware restarts requests by writing 0 and then 1 (11.8.1)
        if not cr2 & _ADON:
            self._stop()
        elif value & _SWSTART and self._event is None:
            self.registers[SR] |= _STRT
            self._rank, self._paused = 0, False
            self._begin()

    # -- converting -------------------------------------------------------------------------------------

    def _begin(self) -> None:
        if self.registers[SR] & _OVR:
            return  # the converter waits until software clears OVR (11.8.1)
        channel = self._channel()
        register, shift = (SMPR2, 3 * channel) if channel < 10 else (SMPR1, 3 * (channel - 10))
        sampling = _SAMPLING_CYCLES[self.registers[register] >> shift & 7]
        cycles = sampling + _RESOLUTION_BITS[adc.CR1.RES.get(self.registers[CR1])]
        divider = 2 * (adc.CCR.ADCPRE.get(self.registers[CCR]) + 1)
        at_ps = self.soc.clock.now_ps + cycles * divider * PS_PER_S // self.soc.clocks.pclk2_hz
        self._event = self.soc.clock.schedule(at_ps, self._done)

    def _stop(self) -> None:
        if self._event is not None:
            self._event.cancel()
            self._event = None
        self._paused = False

    def _channel(self) -> int:
        register = (SQR3, SQR2, SQR1)[self._rank // 6]
        return min(self.registers[register] >> 5 * (self._rank % 6) & 0x1F, 18)

    def _length(self) -> int:
        return adc.SQR1.L.get(self.registers[SQR1]) + 1 if self.registers[CR1] & _SCAN else 1

    def _convert(self) -> None:
        ccr = self.registers[CCR]
        code = self.inputs.sample(self._channel(), sensors=bool(ccr & _TSVREFE), vbat=bool(ccr & _VBATE))
        resolution = adc.CR1.RES.get(self.registers[CR1])
        code >>= 2 * resolution
        if self.registers[CR2] & _ALIGN:
            code <<= 4 + 2 * resolution if resolution < 3 else 2  # 6 bits are aligned to a byte (11.4)
        self.registers[DR] = code

    def _done(self) -> None:
        self._event = None
        cr2 = self.registers[CR2]
        last = self._rank + 1 == self._length()
        watched = cr2 & (_DMA | _EOCS)
        if watched and self.registers[SR] & _EOC:
            self.registers[SR] |= _OVR  # this result is lost (11.8.1)
            self._signal()
            return
        self._convert()
        if last or watched:
            self.registers[SR] |= _EOC
        self._next_conversion(last)
        if cr2 & _DMA and self._wants_dma:
            self._transfer(last)
        self._signal()

    def _next_conversion(self, last: bool) -> None:
        cr2 = self.registers[CR2]
        if last and not cr2 & _CONT:
            self._rank = 0
            return
        unseen = not cr2 & (_DMA | _EOCS) and not self.registers[CR1] & _EOCIE
        if last and unseen and self._length() == 1:
            self._paused = True
            return
        self._rank = 0 if last else self._rank + 1
        self._begin()

    def _transfer(self, last: bool) -> None:
        """Let DMA read DR; without DDS, requests end after the final transfer."""
        served = self.soc.dma.request(self.name)
        if last and served and not self.registers[CR2] & _DDS and not self.soc.dma.remaining(self.name):
            self._wants_dma = False

    def _signal(self) -> None:
        status, enabled = self.registers[SR], self.registers[CR1]
        active = (status & _EOC and enabled & _EOCIE) or (status & _OVR and enabled & _OVRIE)
        self._irq.set(self.name, bool(active))
