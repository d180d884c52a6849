"""The LIS2MDL's threshold interrupt and its pin INT/DRDY (datasheet 8.7 to 8.11; AN5069 6.3 and section 10).

Decisions:

* MROI needs IEN = 1 (AN5069 10.2); the datasheet calls MROI "always enabled".
* the threshold is unsigned and has 16 bits, as in the datasheet's Table 38; AN5069 says 15 bits.
* INT signals crossings only, not MROI (range overflow).
* a changed interrupt setting takes effect at the next sample; IEN = 0 and IEA take effect immediately.
* with IEN = 0 and IEA = 0, bit INT reads ``idle_level``, by default 0 as after reset.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.lis2mdl.registers import CFG_REG_B, CFG_REG_C, INT_CRTL_REG, INT_SOURCE_REG, INT_THS
from fcu_emulator.sensors.pin import EdgeCallback, Pin
from fcu_emulator.sensors.sampling import SampleStream

_CROSSINGS: Final = 0xFF & ~(INT_SOURCE_REG.MROI.mask | INT_SOURCE_REG.INT.mask)
_ABOVE: Final = np.array(
    [INT_SOURCE_REG.P_TH_S_X.mask, INT_SOURCE_REG.P_TH_S_Y.mask, INT_SOURCE_REG.P_TH_S_Z.mask]
)
_BELOW: Final = np.array(
    [INT_SOURCE_REG.N_TH_S_X.mask, INT_SOURCE_REG.N_TH_S_Y.mask, INT_SOURCE_REG.N_TH_S_Z.mask]
)


@dataclass(frozen=True)
class InterruptSettings:
    """The interrupt's settings in the registers."""

    on: bool
    latched: bool
    active_level: int
    axes: tuple[bool, bool, bool]
    threshold: int  # counts
    after_offset: bool  # compare the output, from which the hard-iron offset has been subtracted

    @classmethod
    def decode(cls, mem: bytearray) -> InterruptSettings:
        control = mem[INT_CRTL_REG.addr]
        return cls(
            on=bool(control & INT_CRTL_REG.IEN.mask),
            latched=bool(control & INT_CRTL_REG.IEL.mask),
            active_level=INT_CRTL_REG.IEA.get(control),
            axes=(
                bool(control & INT_CRTL_REG.XIEN.mask),
                bool(control & INT_CRTL_REG.YIEN.mask),
                bool(control & INT_CRTL_REG.ZIEN.mask),
            ),
            threshold=int.from_bytes(mem[INT_THS.addr : INT_THS.addr + INT_THS.size], "little"),
            after_offset=bool(mem[CFG_REG_B.addr] & CFG_REG_B.INT_on_DataOFF.mask),
        )

    def compare(self, compared: NDArray[np.int16], measured: NDArray[np.float64]) -> bytes:
        """Return one byte of INT_SOURCE_REG per sample, without bit INT.

        ``compared``, ``measured``: counts (3, n); ``measured`` is not saturated yet.
        """
        axes, counts = np.array(self.axes), compared.astype(np.int64)
        source = (_ABOVE * axes) @ (counts > self.threshold) + (_BELOW * axes) @ (counts < -self.threshold)
        overflows = ((measured < -32768) | (measured > 32767)).sum(axis=0) > 0
        return bytes((source | INT_SOURCE_REG.MROI.mask * overflows).astype(np.uint8))


class InterruptGenerator:
    """Generator of INT_SOURCE_REG and the INT signal.

    ``compared``: bytes of ``InterruptSettings.compare``; ``idle_level``: bit INT while IEN = 0 and IEA = 0; ``edge``:
    called at each change of the INT signal.
    """

    def __init__(
        self, compared: SampleStream, settings: InterruptSettings, idle_level: int, edge: EdgeCallback
    ) -> None:
        self.compared = compared
        self.settings = settings
        self._idle_level = idle_level
        self._edge = edge
        self._source = 0  # crossings and MROI

    @property
    def level(self) -> int:
        """Level of the INT signal on the pin."""
        active = self.settings.active_level
        return active if self._source & _CROSSINGS else 1 - active

    @property
    def source(self) -> int:
        settings = self.settings
        if not settings.on:
            return 0 if settings.active_level else self._idle_level
        return self._source | self.level

    def configure(self, settings: InterruptSettings, now_ps: int) -> None:
        if settings.on and not self.settings.on and now_ps >= self.compared.next_ps:
            self.compared.advance(now_ps)  # samples before IEN = 1 are not compared
        self.settings = settings
        if not settings.on:
            self._source = 0

    def after_reading_source(self) -> None:
        """Clear latched flags after a read."""
        self._source &= 0 if self.settings.latched else _CROSSINGS

    def catch_up(self, now_ps: int) -> None:
        stream = self.compared
        if not self.settings.on or now_ps < stream.next_ps:
            return
        first = stream.index + 1
        sources = stream.samples(first, stream.latest(now_ps) + 1)[:, 0]
        stream.advance(now_ps)
        active = self.settings.active_level
        for index, signals in self._take(sources):
            self._edge(stream.time_ps(first + index), active if signals else 1 - active)

    def _take(self, sources: NDArray[np.uint8]) -> list[tuple[int, bool]]:
        was = bool(self._source & _CROSSINGS)
        signals = (sources & _CROSSINGS) != 0
        everything = int(np.bitwise_or.reduce(sources))
        if self.settings.latched:
            signals = np.logical_or.accumulate(signals) | was
            self._source |= everything
        else:
            overflow = (self._source | everything) & INT_SOURCE_REG.MROI.mask
            self._source = overflow | int(sources[-1]) & _CROSSINGS
        return [(int(index), bool(signals[index])) for index in np.flatnonzero(np.diff(signals, prepend=was))]


# -- the pin ------------------------------------------------------------------------------------------------

Shown: TypeAlias = Literal["INT", "DRDY"]


class IntDrdyPin:
    """The pin: it shows INT if INT is enabled, else DRDY; it is not driven if both are off, or in 4-wire SPI."""

    def __init__(self) -> None:
        self.pin = Pin("INT/DRDY", level=None)
        self.shows: Shown | None = None

    def configure(self, control: int, now_ps: int) -> None:
        self.shows = None
        if not control & CFG_REG_C.FOURWSPI.mask:
            if control & CFG_REG_C.INT_on_PIN.mask:
                self.shows = "INT"
            elif control & CFG_REG_C.DRDY_on_PIN.mask:
                self.shows = "DRDY"
        if self.shows is None:
            self.pin.drive(None, now_ps)

    def drive(self, signal: Shown, level: int, at_ps: int) -> None:
        if self.shows == signal:
            self.pin.drive(level, at_ps)
