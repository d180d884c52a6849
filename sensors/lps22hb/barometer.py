"""The LPS22HB's measurement: from pressure and temperature to counts (datasheet Tables 3, 4, 17 and 18).

Decision: the pressure's low-pass starts at the value of the first sample after firmware sets the rate or the filter, or
reads LPFP_RES.

Decision: the datasheet gives the barometer's noise for one setting, 0.0075 hPa RMS; other settings multiply this figure
by ``_NOISE``. With the lab's setting, the noise is 0.012 hPa. This corresponds to a height of 10 cm, less
than a step of a staircase.

Decision: a one-shot conversion takes 13 ms in low-noise mode and 5 ms in low-current mode, as in the related LPS22HH.

Approximation: the supply current is that of power-down plus a part proportional to the rate (Table 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.filters import Chain, SampledFilter, chain, low_pass
from fcu_emulator.sensors.front_end import NoiseSource, averaged, noise_key
from fcu_emulator.sensors.lps22hb.declaration import REFERENCE_DEGC, LPS22HBErrors
from fcu_emulator.sensors.lps22hb.registers import CTRL_REG1, RES_CONF
from fcu_emulator.sensors.part import Signal
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream, Times, to_int16

COUNTS_PER_HPA = 4096
COUNTS_PER_DEGC = 100
SAMPLE_BYTES = 5  # pressure of 24 bits, temperature of 16
_ODR_HZ = (0, 1, 10, 25, 50, 75)  # CTRL_REG1.ODR; 6 and 7 measure nothing
_MIDDLE_HPA, _HALF_RANGE_HPA = (
    950.0,
    150.0,
)  # the middle of 800 to 1100 hPa, the range of the relative accuracy
_ONE_SHOT_PS = {False: 13 * PS_PER_S // 10**3, True: 5 * PS_PER_S // 10**3}  # by low current


_NOISE = {  # output RMS / datasheet RMS, by low-current mode and filter (0: none)
    (False, 20): 1.0,
    (False, 9): 1.2,
    (False, 0): 1.4,
    (True, 20): 1.2,
    (True, 9): 1.4,
    (True, 0): 1.6,
}


def _filter(divisor: int) -> Chain:
    return chain((low_pass(1 / divisor),), "settled")


@dataclass(frozen=True)
class BarometerSettings:
    """The measurement's settings in the registers."""

    rate: Fraction  # nominal rate in Hz; 0 is power-down, in which ONE_SHOT works
    low_current: bool
    divisor: int  # cut-off of the low-pass = rate / divisor; 0: none

    @classmethod
    def decode(cls, mem: bytearray) -> BarometerSettings:
        control = mem[CTRL_REG1.addr]
        code = CTRL_REG1.ODR.get(control)
        rate = Fraction(_ODR_HZ[code] if code < len(_ODR_HZ) else 0)
        divisor = 0
        if rate and control & CTRL_REG1.EN_LPFP.mask:
            divisor = 20 if control & CTRL_REG1.LPFP_CFG.mask else 9
        return cls(rate, bool(mem[RES_CONF.addr] & RES_CONF.LC_EN.mask), divisor)

    @property
    def low_pass(self) -> Chain | None:
        return _filter(self.divisor) if self.divisor else None

    def conversion_noise(self) -> float:
        """Return the RMS noise before the filter, divided by the datasheet's figure."""
        behind = _NOISE[self.low_current, self.divisor]
        return behind / _filter(self.divisor).noise_gain if self.divisor else behind


class Barometer:
    """Samples of pressure and temperature; signals have shape (n,).

    ``stream``: five bytes per sample, little-endian, without subtraction of an offset.
    """

    def __init__(
        self, pressure_hpa: Signal, temperature_degc: Signal, errors: LPS22HBErrors, seed: int
    ) -> None:
        self._pressure_hpa = pressure_hpa
        self._temperature_degc = temperature_degc
        self._errors = errors
        self._noise = NoiseSource(noise_key(seed, "LPS22HB"), 1)
        self._filter = SampledFilter(self._unfiltered, axes=1)
        self.settings = BarometerSettings(Fraction(0), low_current=False, divisor=0)
        self._noise_rms_hpa = 0.0  # noise of one conversion
        self.stream = SampleStream(SAMPLE_BYTES, self._produce)
        self.stream.when_world_changes(self._filter.forget)

    def configure(self, settings: BarometerSettings, now_ps: int) -> None:
        """Apply the settings to later samples."""
        was = self.settings
        if settings == was:
            return
        if settings.rate == was.rate and settings.divisor == was.divisor:
            self._filter.split(self.stream.next_number())
        self.settings = settings
        if self._errors.pressure_noise_hpa:
            self._noise_rms_hpa = self._errors.pressure_noise_hpa * settings.conversion_noise()
        if settings.rate != was.rate:
            if settings.rate:
                self.stream.start(now_ps, settings.rate * self._errors.rate_factor)
            else:
                self.stream.stop()
        if settings.rate != was.rate or settings.divisor != was.divisor:
            self.restart_filter()
        self.stream.invalidate()

    def measure_once(self, now_ps: int) -> None:
        self.stream.start_single(now_ps, _ONE_SHOT_PS[self.settings.low_current])

    def restart_filter(self) -> None:
        self._filter.restart(self.settings.low_pass, self.stream.next_number())
        self.stream.invalidate()

    def _produce(self, number: int, t_s: Times) -> bytes:
        count = len(t_s)
        filtered = self.settings.divisor != 0
        hpa = self._filter.block(number, count)[0] if filtered else self._measured_hpa(number, t_s)
        counts = np.rint(hpa * COUNTS_PER_HPA)
        pressure = np.clip(counts, -(1 << 23), (1 << 23) - 1).astype("<i4")
        degc = self._temperature_degc(t_s) + self._errors.temperature_bias_degc
        samples = np.empty((count, SAMPLE_BYTES), dtype=np.uint8)
        samples[:, :3] = pressure.view(np.uint8).reshape(-1, 4)[:, :3]
        samples[:, 3:] = to_int16(degc * COUNTS_PER_DEGC).view(np.uint8).reshape(-1, 2)
        return samples.tobytes()

    def _unfiltered(self, number: int, count: int) -> NDArray[np.float64]:
        return self._measured_hpa(number, self.stream.times_s(number, count))[np.newaxis]

    def _measured_hpa(self, number: int, t_s: Times) -> NDArray[np.float64]:
        conversion_s = _ONE_SHOT_PS[self.settings.low_current] / PS_PER_S
        hpa = self._deviating_hpa(averaged(self._pressure_hpa, t_s, conversion_s), t_s)
        if self._noise_rms_hpa:
            hpa = hpa + self._noise_rms_hpa * self._noise.block(number, len(t_s))[0]
        return hpa

    def _deviating_hpa(self, pressure_hpa: NDArray[np.float64], t_s: Times) -> NDArray[np.float64]:
        errors = self._errors
        hpa = pressure_hpa + errors.pressure_bias_hpa
        if errors.pressure_relative_hpa:
            hpa += errors.pressure_relative_hpa / _HALF_RANGE_HPA * (pressure_hpa - _MIDDLE_HPA)
        if errors.pressure_drift_hpa_per_degc:
            hpa += errors.pressure_drift_hpa_per_degc * (self._temperature_degc(t_s) - REFERENCE_DEGC)
        return hpa


_POWER_DOWN_UA = 1.0
_AT_1_HZ_UA = {False: 12.0, True: 3.0}  # by low current


def supply_current_ua(settings: BarometerSettings) -> float:
    """Return the mean supply current in microampere."""
    return _POWER_DOWN_UA + (_AT_1_HZ_UA[settings.low_current] - _POWER_DOWN_UA) * float(settings.rate)
