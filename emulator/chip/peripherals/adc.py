"""ADC1 (native/peripherals/adc.c), and the voltages at its inputs (RM0368 sections 11.9, 11.10)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Final, TypeAlias

from fcu_emulator.emulator.chip.library import PERIPHERAL_CLASSES, FcuChip, NativePeripheral

Volts: TypeAlias = Callable[[], float]
"""A function that returns the present voltage in V."""

VDDA_V: Final = 3.3
FULL_SCALE: Final = 4095

_CHANNELS: Final = 19  # ADC_CHANNELS of adc.h
_PINS: Final = 16
_BATTERY_CHANNEL, _TEMPERATURE_CHANNEL, _VREFINT_CHANNEL, _VBAT_CHANNEL = 9, 16, 17, 18
_VREFINT_V = 1.21  # STM32F401xB/C datasheet: 1.18 to 1.24 V
_V25_V, _SLOPE_V_PER_DEGC = 0.76, 0.0025
_DIVIDER = 20 / 30  # 10k over 20k (steval_fcu001_v1.h of STSW-FCU001)

_VOLTS = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_int64, ctypes.c_int32)


class _Calls(ctypes.Structure):
    """struct AdcCalls of adc.h."""

    _fields_ = (("volts", _VOLTS),)


class _Voltages(ctypes.Structure):
    """struct AdcInputs of adc.h."""

    _fields_ = (("volts", ctypes.c_double * _CHANNELS), ("called", ctypes.c_uint32))


class AdcInputs:
    """Input voltages of the channels, including the battery voltage."""

    def __init__(self, chip: FcuChip, battery_v: float = 3.7, die_degc: float = 30.0) -> None:
        self._chip = chip
        self._pins: dict[int, Volts] = {}
        calls = _Calls(chip.callback(_VOLTS, self._volts))
        address = chip.library.fcu_connect_adc(chip.handle, ctypes.addressof(calls))
        self._voltages: Any = _Voltages.from_address(address)
        self._set(_VREFINT_CHANNEL, _VREFINT_V)
        self._set(_VBAT_CHANNEL, VDDA_V / 4)
        self.battery_v = battery_v
        self.die_degc = die_degc

    @property
    def battery_v(self) -> float:
        """The battery's voltage, which a divider connects to channel 9."""
        return self._battery_v

    @battery_v.setter
    def battery_v(self, volts: float) -> None:
        self._battery_v = volts
        self._set(_BATTERY_CHANNEL, volts * _DIVIDER)

    @property
    def die_degc(self) -> float:
        """The temperature at the internal sensor."""
        return self._die_degc

    @die_degc.setter
    def die_degc(self, degc: float) -> None:
        self._die_degc = degc
        self._set(_TEMPERATURE_CHANNEL, _V25_V + _SLOPE_V_PER_DEGC * (degc - 25))

    def connect(self, channel: int, volts: Volts | float) -> None:
        """Connect one of the inputs 0 to 15 to a voltage in V, or to a function that returns it.

        A function is called at each conversion, so it is slower than a number. Raises ValueError for another channel.
        """
        if not 0 <= channel < _PINS:
            raise ValueError(f"channel must be from 0 to {_PINS - 1}, not {channel}")
        if callable(volts):
            self._pins[channel] = volts
            self._set(channel, 0.0, called=True)
        else:
            self._set(channel, volts)

    def _set(self, channel: int, volts: float, *, called: bool = False) -> None:
        if self._chip.closed:  # the memory has been freed
            return
        bit = 1 << channel
        self._voltages.volts[channel] = volts
        self._voltages.called = self._voltages.called | bit if called else self._voltages.called & ~bit

    def _volts(self, channel: int) -> float:
        return float(self._pins[channel]())


class Adc(NativePeripheral):
    """ADC1 and the common registers."""

    def __init__(self, chip: FcuChip, index: int, name: str, base: int) -> None:
        super().__init__(chip, index, name, base)
        self.inputs = AdcInputs(chip)


PERIPHERAL_CLASSES["ADC"] = Adc
