"""The virtual board with its clock, world, trace, sensors and firmware.

::

    from fcu_emulator import Board

    board = Board(firmware="lab3")
    board.run_for(3)
    board.world.set_attitude(roll_deg=0, pitch_deg=85, yaw_deg=0)
    board.terminal.expect(r"Pitch: 8[45]\\.")
    assert board.led1.on

Boards are independent of each other. A board belongs to the thread that first runs it.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

from fcu_emulator.emulator.assembly.firmware import (
    Backend,
    Choice,
    FirmwareFactory,
    PythonFirmware,
    choose,
)
from fcu_emulator.emulator.assembly.sensor_set import SensorSet
from fcu_emulator.emulator.assembly.snapshot import Snapshot
from fcu_emulator.emulator.assembly.terminal import Terminal
from fcu_emulator.emulator.boards.description import (
    CRYSTAL_HZ,
    BoardDescription,
    BoardErrors,
    BoardSignals,
    SensorSettings,
    Wiring,
)
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.buses.gpio import BUTTON_S, Gpio, Led, parse_pin
from fcu_emulator.emulator.buses.i2c import FAST_MODE_HZ, I2CBus, I2CMaster
from fcu_emulator.emulator.buses.spi import SpiBus, SpiMaster
from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.chip.memory_map import CHIP_NAME
from fcu_emulator.emulator.clock import PS_PER_S, Clock, TickCounts, to_ps
from fcu_emulator.emulator.errors import FcuError, InputError
from fcu_emulator.emulator.python_cpu.cpu import PythonCpu
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from fcu_emulator.emulator.python_cpu.timer import IntervalTimer
from fcu_emulator.emulator.renamed import OldName, warn_renamed
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.trace import BusTransfer, Trace
from fcu_emulator.emulator.world import World
from fcu_emulator.sensors.errors import Quality

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.calls import Caller, Scratch
    from fcu_emulator.emulator.chip.firmware import ArmFirmware
    from fcu_emulator.emulator.scenario import Scenario

LONGEST_RUN_S = 1_000_000  # eleven days
_TRIAL_STEP_S, _LONGEST_TRIAL_S = 0.02, 2.0
_MOST_TRIAL_ACCESSES, _MOST_TRIAL_FAULTS = 100_000, 1_000
"""Number of slow operations after which a trial ends. A limit in wall time would depend on the machine's speed."""


class Board:
    """A STEVAL-FCU001V1.

    ``firmware``: a name (``"lab3"``, ``"template"``, ``"solution"`` or ``"template-arm"``), an ELF,
    HEX or BIN file, a callable that takes the HAL, or None for sensors only.
    ``scenario``: a name, a path or a loaded scenario. The scenario's firmware is the default.
    ``wiring``: ``"lab3"`` (all sensors on I2C2), ``"fcu001v1"`` (SPI2, as on the real board), or
    None to select the wiring by the firmware's symbols or by a trial run.
    ``seed``: selects offsets and noise. The default is the scenario's seed, else 0.
    ``ideal``: sensors without errors, on a board without iron.
    ``cold_start``: if True, the supply is off before t = 0, and the board warms up. The LSM6DSL does
    not answer for 15 ms and the LIS2MDL for 20 ms (no acknowledge on I2C, 0xFF on SPI). By default
    the scenario decides; without a scenario, the supply has been on for a long time.
    ``crystal_hz``: the chip's crystal, 4 to 26 MHz. The default is the scenario's crystal, else 16 MHz.

    Times are virtual seconds since power-on. Close a board with ``close()`` or a ``with`` block.
    Raises InputError or ScenarioError.
    """

    arm = OldName("chip")
    description: ClassVar[BoardDescription] = FCU001V1
    """Description of the board type; a subclass may set another description."""

    def __init__(
        self,
        firmware: str | Path | FirmwareFactory | None = None,
        *,
        scenario: str | Path | Scenario | None = None,
        wiring: str | None = None,
        seed: int | None = None,
        ideal: bool = False,
        cold_start: bool = False,
        crystal_hz: int | None = None,
        profile: str | None = None,
    ) -> None:
        wiring = wiring if profile is None else _given_as_profile(profile)
        if seed is not None and not isinstance(seed, int):
            raise InputError(f"seed must be an integer, not {seed!r}")
        board = self.description
        plan = _load(scenario, board, seed)
        if firmware is None:
            firmware = (plan and plan.firmware) or None
        crystal_hz = crystal_hz or (plan.crystal_hz if plan else CRYSTAL_HZ)
        reaches_sensors = partial(self._reaches_sensors, firmware, crystal_hz=crystal_hz)
        self.booted = choice = choose(
            board, firmware, wiring, plan.firmware_settings() if plan else None, reaches_sensors
        )
        self.scenario = plan
        self.seed = seed if seed is not None else plan.seed if plan else 0
        self.clock = clock = Clock()
        self.trace = Trace()
        parts = plan.sensor_settings() if plan else SensorSettings()
        if ideal:
            parts = replace(parts, quality="ideal")
        self.world, own = _world_of(plan, parts.quality, self.seed, clock)
        powered_on_ps = 0 if cold_start else plan.powered_on_ps if plan else None
        powered_for_s = math.inf if powered_on_ps is None else -powered_on_ps / PS_PER_S
        self.world.warm_up(own.heating_degc, own.thermal_s, powered_for_s)
        self.world.let_pressure_wander(own.pressure_wander_hpa, self.seed)
        self.sensors = SensorSet(board, self.world, clock, parts, self.seed, powered_on_ps)
        speed_hz = plan.i2c_speed_hz if plan else FAST_MODE_HZ
        i2c = {name: I2CBus(name, clock, self.trace, speed_hz) for name in board.i2c}
        spi = {name: SpiBus(name, clock, self.trace) for name in board.spi}
        self.sensors.attach(i2c, spi, choice.wiring)
        self.sensors.observe(self.trace)
        uart = Uart(board.serial.peripheral, clock, self.trace, board.serial.clock_hz)
        self.gpio = Gpio(clock, self.trace)
        self.leds = {name: Led(name, self.gpio, *pin) for name, pin in board.leds.items()}
        """The LEDs by name, in the order of the board's description."""
        self.signals = BoardSignals(
            board, choice.wiring, clock, self.trace, self.gpio, uart, i2c, spi, self.seed, own, crystal_hz
        )
        """Signals connected to the chip's pins."""
        self._caller: Caller | None = None
        self.chip: ArmFirmware | None = None
        """The chip that executes compiled firmware; None for firmware in Python."""
        self._run = run = _RunState(self._boot(choice))
        self.timer = run.backend.timer
        """Timer of the firmware's periodic callback."""
        self._i2c = {name: I2CMaster(bus, run.until_ps) for name, bus in i2c.items()}
        self._spi = {name: SpiMaster(bus, run.until_ps) for name, bus in spi.items()}
        self.terminal = Terminal(uart, clock, run.until_ps)
        self.terminal.diagnosis = _diagnosis_of(self.chip)
        self.ideal = parts.quality == "ideal"
        """Whether the sensors have no noise, offset or scale error."""
        self._named = {**self.leds, **self._i2c, **self._spi, board.timer.peripheral: self.timer}
        vars(self).update((name.lower(), one) for name, one in self._named.items())
        if plan:
            plan.play(weakref.proxy(self))  # scheduled actions must not keep the board alive

    def __repr__(self) -> str:
        plays = f", scenario {self.scenario.name!r}" if self.scenario else ""
        state = "closed" if self._run.closed else f"at {self.now_s:g} s"
        firmware = f"firmware {self.booted.name!r}" if self.booted.name else "no firmware"
        return f"<Board: {firmware}{plays}, wiring {self.booted.wiring.name!r}, seed {self.seed}, {state}>"

    def __getattr__(self, name: str) -> Any:
        """Raise AttributeError with the known names, such as ``led1``, ``i2c2`` and ``tim9``."""
        known = ", ".join(one.lower() for one in self.__dict__.get("_named", ()))
        raise AttributeError(f"a board has no {name!r}; the {self.description.name} has {known}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the firmware and close the trace. The board cannot run again."""
        self._run.closed = True
        self._end_firmware()
        self.trace.close()

    @property
    def now_s(self) -> float:
        """Virtual time since power-on."""
        return self.clock.now_s

    @property
    def running(self) -> bool:
        """Whether virtual time is passing, for example during a callback."""
        return self._run.running

    def run_for(self, seconds: float) -> None:
        """Run for this much virtual time. Raises FirmwareError."""
        if not isinstance(seconds, int | float) or not 0 <= seconds <= LONGEST_RUN_S:
            raise InputError(
                f"cannot run for {seconds!r} s: the duration must be from 0 to {LONGEST_RUN_S}",
                kind="duration",
            )
        self.run_until_ps(self.clock.now_ps + to_ps(seconds))

    def run_until(self, seconds: float) -> None:
        """Run until this virtual time; a past time has no effect. Raises FirmwareError."""
        if not isinstance(seconds, int | float) or not 0 <= seconds <= LONGEST_RUN_S:
            raise InputError(
                f"end must be from 0 to {LONGEST_RUN_S} s since power-on, not {seconds!r}",
                kind="time",
            )
        if to_ps(seconds) > self.clock.now_ps:
            self.run_until_ps(to_ps(seconds))

    def run_until_ps(self, at_ps: int) -> None:
        """Run until this time in picoseconds."""
        self._run.until_ps(at_ps)

    def led(self, name: str) -> Led:
        """Return a LED by its name ("LED1"). Raises InputError."""
        return _named(self.leds, name, "LED")

    def press_button(self, pin: str, level: int = 0, seconds: float = BUTTON_S) -> None:
        """Press a button between a pin ("PA0") and ground, or the supply (``level`` 1), for some seconds from now.

        The pin is released later, while the board runs. Raises InputError.
        """
        try:
            where = parse_pin(pin)
        except ValueError as error:
            raise InputError(f"pin {error}") from None
        if level not in (0, 1):
            raise InputError(f"level must be 0 (ground) or 1 (supply), not {shown(level)}")
        if not isinstance(seconds, int | float) or not 0 < seconds <= LONGEST_RUN_S:
            raise InputError(f"seconds must be above 0 and at most {LONGEST_RUN_S}, not {shown(seconds)}")
        self.gpio.press(*where, level, self.clock.now_ps + to_ps(seconds))

    def i2c(self, name: str | None = None) -> I2CMaster:
        """Return the named bus master ("I2C2"), or the first bus master."""
        return _named(self._i2c, name, "I2C bus")

    def spi(self, name: str | None = None) -> SpiMaster:
        """Return the named bus master ("SPI2"), or the first bus master."""
        return _named(self._spi, name, "SPI bus")

    def recent_transfers(self) -> list[BusTransfer]:
        """Return each bus's latest transfers, without bursts of Python firmware."""
        latest = [one for bus in self.signals.i2c.values() for one in bus.recent_transfers()]
        latest += [one for bus in self.signals.spi.values() for one in bus.recent_transfers()]
        return sorted(latest, key=lambda transfer: transfer.t_ps)

    def snapshot(self) -> Snapshot:
        """Return the state between runs. Raises InputError with Python firmware."""
        return Snapshot(self)

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this board."""
        snapshot.restore(self)

    def handles(self, peripheral: str) -> bool:
        """Return whether the firmware is handling a peripheral's interrupt ("TIM9")."""
        return self._run.backend.handles(peripheral)

    def motor_duties(self) -> tuple[float, ...]:
        """Return each motor's PWM duty, 0 to 1."""
        if self.chip is None:
            return tuple(0.0 for _ in self.description.motors)
        timers = self.chip.chip.timers
        outputs = [timers[timer].pwm(channel) for timer, channel in self.description.motors]
        return tuple(output.duty if output else 0.0 for output in outputs)

    def other_uarts(self) -> dict[str, bytes]:
        """Return the first 64 KiB from each USART without a terminal."""
        return {} if self.chip is None else self.chip.chip.usarts.unconnected_output()

    def supply_current_ua(self) -> dict[str, float]:
        """Return the configured supply current of each sensor, and of a chip ("STM32F401")."""
        currents = self.sensors.supply_current_ua()
        return currents if self.chip is None else currents | {CHIP_NAME: self.chip.supply_current_ua()}

    def variable(self, name: str) -> Any:
        """Return a C variable by name. Raises KeyError."""
        return self._run.backend.variable(name)

    def set_variable(self, name: str, value: Any) -> None:
        """Set a C variable to a number, sequence or mapping of members.

        Raises KeyError, or InputError if the value does not fit.
        """
        self._built("set_variable").set_variable(name, value)

    def call(
        self,
        name: str,
        *arguments: Any,
        keep: bool = False,
        max_instructions: int = 10_000_000,
        timeout_s: float = 1.0,
    ) -> Any:
        """Call a C function of compiled firmware, and return its result.

        Numbers are passed by value. For a pointer parameter, pass an address, a string, bytes, a structure's
        members (mapping, object or sequence), or a sequence of values to which the pointer will point.
        Changes of these values are copied back to lists, dictionaries, objects and byte arrays. After the
        call, the chip is restored, unless ``keep`` is set.

        ``max_instructions`` limits functions that compute; ``timeout_s`` (virtual time) limits
        functions that wait. Raises InputError if the function cannot be called, and CallError if it fails or
        does not return.
        """
        return self._calls("call").call(name, arguments, keep, max_instructions, timeout_s)

    def scratch(self) -> AbstractContextManager[Scratch]:
        """Return a copy of the chip. Calls in this copy have no effect on the board."""
        return self._calls("scratch").scratch()

    def _calls(self, what: str) -> Caller:
        if self._caller is None:
            self._caller = self._built(what).caller(self._restoring)
        return self._caller

    def _built(self, what: str) -> ArmFirmware:
        if self.chip is None:
            raise InputError(
                f'{what} needs firmware built for the chip: Board(firmware="mylab.elf")', kind="no_chip"
            )
        return self.chip

    @contextmanager
    def _restoring(self) -> Iterator[None]:
        saved = self.snapshot()
        try:
            yield
        finally:
            saved.restore(self)

    @classmethod
    def _reaches_sensors(
        cls, firmware: str | Path | FirmwareFactory | None, wiring: Wiring, *, crystal_hz: int
    ) -> bool:
        board = cls(firmware, wiring=wiring.name, ideal=True, crystal_hz=crystal_hz)
        arm = board._built("a trial")
        with suppress(FcuError):  # the run after this trial will report the error
            while board.now_s < _LONGEST_TRIAL_S:
                board.run_for(_TRIAL_STEP_S)
                if any(one.result == "ok" and one.device for one in board.recent_transfers()):
                    return True
                accesses, faults = arm.chip.core.status().accesses, arm.faults.seen
                if accesses > _MOST_TRIAL_ACCESSES or faults > _MOST_TRIAL_FAULTS:
                    return False
        return False

    def _boot(self, choice: Choice) -> Backend:
        signals = self.signals
        self._end_firmware: Callable[[], object] = bool  # by default, the end of the firmware has no effect
        if choice.image is not None:
            from fcu_emulator.emulator.chip.firmware import ArmFirmware

            self.chip = ArmFirmware(signals, choice.image)
            return self.chip
        timer = self.description.timer
        if choice.factory is None:
            idle = IntervalTimer(timer.peripheral, self.clock, self.trace, timer.input_hz, lambda: None)
            return _NoFirmware(self.clock, idle)
        cpu = PythonCpu(self.clock)
        i2c = signals.i2c[choice.wiring.bus]
        hal = VirtualHal(self.clock, self.trace, cpu, i2c, signals.uart, self.gpio, timer)
        self._end_firmware = weakref.finalize(self, cpu.close)
        return PythonFirmware(choice.factory(hal), cpu, hal)


class _NoFirmware:
    """A processor that stays in reset."""

    def __init__(self, clock: Clock, timer: TickCounts) -> None:
        self._clock = clock
        self.timer = timer

    def run_until_ps(self, at_ps: int) -> None:
        self._clock.advance_to(at_ps)

    def variable(self, name: str) -> Any:
        raise KeyError(name)

    def handles(self, peripheral: str) -> bool:
        del peripheral
        return False


class _RunState:
    """Advances a board's time until the board is closed."""

    def __init__(self, backend: Backend) -> None:
        self.backend = backend
        self.closed = False
        self.running = False

    def until_ps(self, at_ps: int) -> None:
        if self.closed:
            raise InputError("cannot run a closed board; create another one")
        before, self.running = self.running, True
        try:
            self.backend.run_until_ps(at_ps)
        finally:
            self.running = before


_One = TypeVar("_One")


def _world_of(plan: Scenario | None, quality: Quality, seed: int, clock: Clock) -> tuple[World, BoardErrors]:
    if plan:
        own = plan.board_errors(quality, seed)
        return plan.create_world(clock, own), own
    own = BoardErrors.of_quality(quality, seed)
    world = World(clock)
    world.set_iron(own.hard_iron_mgauss, own.soft_iron())
    return world, own


def _named(ones: Mapping[str, _One], name: str | None, what: str) -> _One:
    if not ones:
        raise InputError(f"this board has no {what}")
    wanted = next(iter(ones)) if name is None else name
    if wanted not in ones:
        raise InputError(f"unknown {what} {wanted!r}; known: {', '.join(ones)}")
    return ones[wanted]


def _given_as_profile(wiring: str) -> str:
    warn_renamed("profile", "wiring", stacklevel=3)
    return wiring


def _diagnosis_of(arm: ArmFirmware | None) -> Callable[[], str]:
    """Return a function that describes a failure and has no reference to the board."""
    return arm.diagnosis_text if arm is not None else lambda: ""


def _load(
    scenario: str | Path | Scenario | None, board: BoardDescription, seed: int | None
) -> Scenario | None:
    if scenario is None:
        return None
    from fcu_emulator.emulator.scenario import (  # imports pydantic, which plain boards do not need
        Scenario,
        load_scenario,
    )

    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario, board, seed)
