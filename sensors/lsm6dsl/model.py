"""The LSM6DSL's behaviour behind its registers.

Decisions where the documents are silent: SW_RESET takes effect immediately and its bit reads 1 for 50 us; reading
OUT_TEMP_H clears the temperature's data-ready flag; reserved ODR codes measure nothing; a new configuration applies
from the next sample on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from fcu_emulator.sensors.declaration import Bus, Function, Quantity, Wires
from fcu_emulator.sensors.errors import PartErrors
from fcu_emulator.sensors.lsm6dsl import accelerometer, gyroscope
from fcu_emulator.sensors.lsm6dsl.accelerometer import Accelerometer, EventSamples
from fcu_emulator.sensors.lsm6dsl.banks import EMBEDDED, MAIN, Banks, Rounding, titled_maps
from fcu_emulator.sensors.lsm6dsl.declaration import BUS, FUNCTIONS, SIGNALS, LSM6DSLErrors
from fcu_emulator.sensors.lsm6dsl.den import DataEnable
from fcu_emulator.sensors.lsm6dsl.embedded import EmbeddedFunctions
from fcu_emulator.sensors.lsm6dsl.events import Events
from fcu_emulator.sensors.lsm6dsl.feature import Feature, FeatureContext, Signals, Violations
from fcu_emulator.sensors.lsm6dsl.fifo import Fifo
from fcu_emulator.sensors.lsm6dsl.function_sources import FunctionSources
from fcu_emulator.sensors.lsm6dsl.gyroscope import Gyroscope
from fcu_emulator.sensors.lsm6dsl.hub import SensorHub
from fcu_emulator.sensors.lsm6dsl.measuring import (
    Measuring,
    Thermometer,
    measuring_violations,
    supply_current_ua,
)
from fcu_emulator.sensors.lsm6dsl.pins import BOOT_PS, Boot, DataReadySignals, Routing, int2_is_input
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL3_C,
    CTRL4_C,
    CTRL9_XL,
    FIFO_DATA_OUT,
    FUNC_CFG_ACCESS,
    X_OFS_USR,
    Y_OFS_USR,
    Z_OFS_USR,
)
from fcu_emulator.sensors.lsm6dsl.timestamp import Timestamp
from fcu_emulator.sensors.part import SelfClearingBits, Sensor, Signal, Write
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register import Register, RegisterMap
from fcu_emulator.sensors.register_file import NEVER_PS, RegisterFile
from fcu_emulator.sensors.sampling import PS_PER_S

_SW_RESET_PS = 50 * PS_PER_S // 10**6  # AN5040 5.7
_DEN_AXES = CTRL9_XL.DEN_X.mask | CTRL9_XL.DEN_Y.mask | CTRL9_XL.DEN_Z.mask
_FIFO_BURST = {FIFO_DATA_OUT.addr + 1: FIFO_DATA_OUT.addr}  # after FIFO_DATA_OUT_H comes _L (AN5040 4.7)


class Features:
    """All functions other than plain measuring, called in a fixed order.

    Activity recognition calls ``rate_changed(at_ps)``; data enable calls ``stream_changed()``.
    """

    def __init__(
        self,
        chip: FeatureContext,
        samples: EventSamples,
        rate_changed: Callable[[int], None],
        stream_changed: Callable[[], None],
    ) -> None:
        self.events = Events(chip, samples, rate_changed)
        self.data_enable = DataEnable(chip, stream_changed)
        self.boot = Boot(chip.signals)
        sources, timestamp = FunctionSources(chip), Timestamp(chip)
        self.hub = SensorHub(chip, sources)
        # Events come first, because they may change the rates. The FIFO comes after the features whose signals it
        # uses. Pins come last.
        self._all: tuple[Feature, ...] = (
            self.events,
            self.data_enable,
            Rounding(chip),
            timestamp,
            EmbeddedFunctions(chip, sources),
            self.hub,
            Fifo(chip, timestamp),
            sources,
            DataReadySignals(chip),
            self.boot,
            Routing(chip),
        )

    def configuration(self) -> set[type[Register]]:
        return {register for feature in self._all for register in feature.CONFIGURATION}

    def configure(self, now_ps: int, because_of: type[Register] | None = None) -> None:
        """Let all features, or only the features that ``because_of`` configures, decode registers."""
        for feature in self._all:
            if because_of is None or because_of in feature.CONFIGURATION:
                feature.configure(now_ps)

    def catch_up(self, now_ps: int) -> None:
        for feature in self._all:
            if feature.active:
                feature.catch_up(now_ps)

    def catch_up_with_events(self, at_ps: int) -> None:
        for feature in self._all:
            if feature.active and feature is not self.events:
                feature.catch_up(at_ps)

    def reset(self, now_ps: int) -> None:
        for feature in self._all:
            feature.reset(now_ps)

    def next_event_ps(self) -> int:
        return min((feature.next_event_ps() for feature in self._all if feature.active), default=NEVER_PS)


class LSM6DSL(Sensor):
    """Accelerometer, gyroscope and thermometer; signals in the sensor's right-handed axes.

    Signals (:data:`fcu_emulator.sensors.part.Signal`): ``acceleration_g`` is the specific force (n, 3),
    ``angular_rate_dps`` (n, 3), ``temperature_degc`` (n,). ``errors``: None for an ideal sensor; ``seed``: selects the
    noise. ``den_axes_on``: CTRL9_XL resets to 0xE0. ``powered_on_ps``: time of power-on; registers answer 15 ms later
    (AN5040 5.7). With None, the start-up is already over.
    """

    NAME: ClassVar[str] = "LSM6DSL"
    WHO_AM_I: ClassVar[int] = 0x6A
    MAP: ClassVar[RegisterMap] = MAIN
    SIGNALS: ClassVar[tuple[Quantity, ...]] = SIGNALS
    BUS: ClassVar[Bus] = BUS
    ERRORS: ClassVar[type[PartErrors]] = LSM6DSLErrors
    FUNCTIONS: ClassVar[tuple[Function, ...]] = FUNCTIONS
    BANKS: ClassVar[dict[str, RegisterMap]] = EMBEDDED

    def __init__(
        self,
        acceleration_g: Signal,
        angular_rate_dps: Signal,
        temperature_degc: Signal,
        errors: LSM6DSLErrors | None = None,
        seed: int = 0,
        *,
        powered_on_ps: int | None = None,
        den_axes_on: bool = False,
    ) -> None:
        super().__init__(self.MAP, _FIFO_BURST, 0 if powered_on_ps is None else powered_on_ps + BOOT_PS)
        errors = errors or LSM6DSLErrors()
        self._banks = Banks(self.registers)
        xl = Accelerometer(acceleration_g, temperature_degc, errors, seed)
        self._measuring = Measuring(
            self.registers,
            xl,
            Gyroscope(angular_rate_dps, temperature_degc, errors, seed),
            Thermometer(temperature_degc, errors.temperature_offset_degc),
        )
        self.streams = self._measuring.streams
        self._ctrl9_xl = _DEN_AXES if den_axes_on else CTRL9_XL.reset
        self._reset_registers()
        self._clearing = SelfClearingBits(self.registers, CTRL3_C)
        self.int1, self.int2 = Pin("INT1"), Pin("INT2")
        self.int2.on_input = self._int2_applied
        self._chip = FeatureContext(
            self.registers,
            self._banks.embedded,
            *self._measuring.streams,
            Signals(),
            self.int1,
            self.int2,
            self.catch_up,
            rate_factor=errors.rate_factor,
        )
        self._features = Features(
            self._chip,
            xl.for_events,
            self._rate_changed,
            self._stream_changed,
        )
        self._violations = Violations(self._chip)
        self._wire()

    @classmethod
    def maps(cls) -> dict[str, RegisterMap]:
        return titled_maps()

    def files(self) -> tuple[RegisterFile, ...]:
        return self._banks.files()

    def supply_current_ua(self) -> float:
        return supply_current_ua(self.registers.mem)

    def spi_wires(self) -> Wires:
        return 3 if self.registers.mem[CTRL3_C.addr] & CTRL3_C.SIM.mask else 4

    def pins(self) -> tuple[Pin, ...]:
        return self.int1, self.int2

    def catch_up(self, now_ps: int) -> None:
        self._features.catch_up(now_ps)

    def next_event_ps(self) -> int:
        return self._features.next_event_ps()

    @property
    def pass_through(self) -> bool:
        """Whether the host's I2C reaches the auxiliary bus (AN5040 7.3)."""
        return self._features.hub.pass_through

    def attach_auxiliary(self, address: int, device: Sensor) -> None:
        """Connect ``device`` to the sensor hub at a 7-bit address."""
        self._features.hub.bus.attach(address, device)

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """Return lowest value, highest value and LSB of a channel as configured, in the channel's unit.

        ``channel``: ``acceleration_g``, ``angular_rate_dps`` or ``temperature_degc``; else KeyError.
        """
        return self._measuring.sample_range(channel)

    # -- wiring -----------------------------------------------------------------------------------------

    def _writer(self, registers: RegisterFile) -> Write:
        del registers  # a burst may end in another bank
        return self._write_across_banks

    def _write_across_banks(self, address: int, data: bytes, now_ps: int) -> None:
        for value in data:
            self.active.write(address, bytes((value,)), now_ps)
            address = self.active.advance(address, 1)

    def _wire(self) -> None:
        main = self.registers
        main.before_read(CTRL3_C, self._clearing.before_read)
        main.on_write(CTRL3_C, self._write_ctrl3)
        offsets = X_OFS_USR, Y_OFS_USR, Z_OFS_USR
        measuring = {*accelerometer.CONFIGURATION, *gyroscope.CONFIGURATION, *offsets}
        for register in (measuring | self._features.configuration()) - {CTRL3_C}:  # CTRL3_C has another hook
            main.on_write(register, self._configure)
        for bank in self.files():
            bank.on_write(FUNC_CFG_ACCESS, self._select_bank)

    # -- behaviour --------------------------------------------------------------------------------------

    def _write_ctrl3(self, old: int, new: int, now_ps: int) -> None:
        self.catch_up(now_ps)  # with the old settings
        boot, reset = new & CTRL3_C.BOOT.mask, new & CTRL3_C.SW_RESET.mask
        if boot and reset:
            self.registers.note(
                now_ps, "forbidden", "boot-and-reset", "CTRL3_C: BOOT and SW_RESET at once"
            )  # AN5040 5.7
        if reset and not self._clearing.pending(CTRL3_C.SW_RESET.mask, now_ps):
            self._measuring.refresh(now_ps)
            self._reset_registers()
            self._measuring.reset()
            self._features.reset(now_ps)
            self._clearing.begin(CTRL3_C.SW_RESET.mask, now_ps + _SW_RESET_PS)
            self._configure(old, new, now_ps)
        if boot and not self._clearing.pending(CTRL3_C.BOOT.mask, now_ps):
            # BOOT does not change the configuration
            self._clearing.begin(CTRL3_C.BOOT.mask, now_ps + BOOT_PS)
            self._features.boot.begin(now_ps)
        control = self.registers.mem[CTRL3_C.addr]
        self._measuring.set_format()  # BDU and BLE
        for bank in self.files():
            bank.increment = bool(control & CTRL3_C.IF_INC.mask)
        self._features.configure(now_ps, because_of=CTRL3_C)

    def _configure(self, old: int, new: int, now_ps: int) -> None:
        del old, new
        self.catch_up(now_ps)  # with the old settings
        self.i2c_off = bool(self.registers.mem[CTRL4_C.addr] & CTRL4_C.I2C_disable.mask)
        self._violations.report(measuring_violations(self.registers.mem), now_ps)
        self._apply(now_ps)

    def _rate_changed(self, at_ps: int) -> None:
        self._features.catch_up_with_events(at_ps)
        self._apply(at_ps)

    def _stream_changed(self) -> None:
        self._measuring.show_through(self._chip.gates.shown)

    def _apply(self, now_ps: int) -> None:
        self._measuring.refresh(now_ps)
        activity = self._features.events.activity
        self._measuring.apply(activity.effective(self.registers.mem), now_ps)
        self._features.configure(now_ps)
        if activity.enabled:  # the rates can then change without a write, even between two reads
            self._measuring.catch_up_before_reading(self.catch_up)

    def _int2_applied(self, at_ps: int, level: int) -> None:
        if not int2_is_input(self.registers.mem):
            self.registers.note(
                at_ps, "forbidden", "int2-driven", "INT2 driven from outside while it is an output"
            )
            return
        self.version[0] += 1  # a new version ends the trains of samples
        self.catch_up(at_ps)
        self._measuring.refresh(at_ps)
        self._features.data_enable.level_changes(level, at_ps)
        self._features.hub.level_changes(level, at_ps)
        self._apply(at_ps)
        if self._accessed is not None:  # the next pin edge may be earlier, as after a write
            self._accessed()

    def _reset_registers(self) -> None:
        for bank in self.files():
            bank.reset()
        self.registers.mem[CTRL9_XL.addr] = self._ctrl9_xl

    def _select_bank(self, old: int, new: int, now_ps: int) -> None:
        del old
        chosen = self._banks.select(new, now_ps)
        if chosen is not self.active:
            self._activate(chosen)
