"""The virtual board: one clock, one world, one trace, the sensors on their bus, and the firmware.

::

    from emulator import Board

    board = Board(firmware="lab3")
    board.run_for(3)                       # seconds of virtual time
    board.world.set_attitude(roll_deg=0, pitch_deg=85, yaw_deg=0)
    board.terminal.expect(r"Pitch: 8[45]\\.")
    assert board.led1.on

A board without firmware is a bus with sensors, for tests of drivers::

    board = Board()
    board.i2c2.write_read(0x6B, b"\\x0f", 1)   # b"\\x6a", the LSM6DSL's WHO_AM_I

Boards share nothing; a class of them may live in one process. A board belongs to the thread that first runs
it.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from emulator.board.boot import Choice, choose
from emulator.board.firmwares import Backend, FirmwareFactory, NoFirmware, PythonFirmware
from emulator.board.sensor_set import SensorSet
from emulator.board.snapshot import Snapshot
from emulator.board.terminal import Terminal
from emulator.boards.description import SensorSettings
from emulator.boards.fcu001v1 import LED1_PIN, LED2_PIN, UART_CLOCK_HZ
from emulator.buses.gpio import Gpio, Led
from emulator.buses.i2c import FAST_MODE_HZ, I2CBus
from emulator.buses.i2c_master import I2CMaster
from emulator.buses.spi import SpiBus, SpiMaster
from emulator.buses.uart import Uart
from emulator.errors import InputError
from emulator.python_cpu.core import Core
from emulator.python_cpu.hal import Hal
from emulator.time.clock import Clock, to_ps
from emulator.trace import Trace
from emulator.world import World

if TYPE_CHECKING:
    from emulator.chip.calls import Caller, Scratch
    from emulator.chip.firmware import ArmFirmware
    from emulator.chip.image import FirmwareImage
    from emulator.scenario import Scenario


LONGEST_RUN_S = 1_000_000  # eleven days


class Board:
    """A STEVAL-FCU001V1.

    ``firmware``: a name (``"lab3"`` and ``"template"`` in Python, ``"solution"`` and ``"template-arm"`` in
    C), an ELF, HEX or BIN file for the chip, a callable that takes the HAL and returns the firmware, or None
    for none. ``scenario``: a name, a path or a loaded one; it brings its firmware unless another is given.
    ``profile``: how the sensors are wired (``"lab3"``: all on I2C2; ``"fcu001v1"``: on SPI2, as on the real
    board); None: as the firmware needs it, where its file says so, else ``"lab3"``. ``seed``: which board of
    the class this is, and its noise; None: the scenario's, else 0. ``ideal``: sensors without any error.
    ``cold_start``: False, as after the reset button, with sensors powered long before; True, with their
    supply switched on at t = 0, so that at first LSM6DSL (15 ms) and LIS2MDL (20 ms) do not answer: no
    acknowledge on I2C, 0xFF on SPI.

    Times are seconds of virtual time since power-on. A board may be closed when it has done its work, by
    ``close()`` or at the end of a ``with`` block; what is only forgotten is cleared away as well.

    Raises InputError (ScenarioError) when a name, a file or a value cannot be used.
    """

    def __init__(
        self,
        firmware: str | Path | FirmwareFactory | None = None,
        *,
        scenario: str | Path | Scenario | None = None,
        profile: str | None = None,
        seed: int | None = None,
        ideal: bool = False,
        cold_start: bool = False,
    ) -> None:
        if seed is not None and not isinstance(seed, int):
            raise InputError(f"seed is {seed!r}; give an integer")
        plan = _load(scenario)
        if firmware is None and plan is not None:
            firmware = plan.firmware
        self.booted = choice = choose(firmware, profile, plan.firmware_settings() if plan else None)
        self.scenario = plan
        self.seed = seed if seed is not None else plan.seed if plan else 0
        self.clock = clock = Clock()
        self.trace = Trace()
        self.world = plan.create_world(lambda: clock.now_s) if plan else World(lambda: clock.now_s)
        settings = plan.sensor_settings() if plan else SensorSettings()
        if ideal:
            settings = replace(settings, grade="ideal")
        self.sensors = SensorSet(self.world, clock, settings, self.seed, 0 if cold_start else None)
        bus = I2CBus("I2C2", clock, self.trace, plan.i2c_speed_hz if plan else FAST_MODE_HZ)
        spi = SpiBus("SPI2", clock, self.trace)
        self.sensors.attach(bus, spi, choice.profile)
        self.sensors.observe(self.trace)
        uart = Uart("USART1", clock, self.trace, UART_CLOCK_HZ)
        self.gpio = Gpio(clock, self.trace)
        self.led1 = Led("LED1", self.gpio, *LED1_PIN)
        self.led2 = Led("LED2", self.gpio, *LED2_PIN)
        self._caller: Caller | None = None
        self.arm: ArmFirmware | None = None
        """The chip that executes built firmware; None for firmware in Python."""
        self._run = run = _Run(self._boot(choice, bus, spi, uart))
        self.tim9 = run.backend.tim9
        self.i2c2 = I2CMaster(bus, run.until_ps)
        self.spi2 = SpiMaster(spi, run.until_ps)
        self.terminal = Terminal(uart, clock, run.until_ps)
        if plan:
            plan.play(weakref.proxy(self))  # what it schedules must not keep the board alive

    def __repr__(self) -> str:
        plays = f", scenario {self.scenario.name!r}" if self.scenario else ""
        state = "closed" if self._run.closed else f"at {self.now_s:g} s"
        firmware = f"firmware {self.booted.name!r}" if self.booted.name else "no firmware"
        return f"<Board: {firmware}{plays}, profile {self.booted.profile.name!r}, seed {self.seed}, {state}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the firmware and the trace's files; the board can still be looked at, but runs no more.

        Harmless when it has been closed already.
        """
        self._run.closed = True
        self._end_firmware()
        self.trace.close()

    @property
    def now_s(self) -> float:
        """Seconds of virtual time since power-on."""
        return self.clock.now_s

    def run_for(self, seconds: float) -> None:
        """Run for exactly this much virtual time. Raises FirmwareError when the firmware itself fails."""
        if not isinstance(seconds, int | float) or not 0 <= seconds <= LONGEST_RUN_S:
            raise InputError(
                f"cannot run for {seconds!r} s; give a number of seconds from 0 to {LONGEST_RUN_S}"
            )
        self.run_until_ps(self.clock.now_ps + to_ps(seconds))

    def run_until(self, seconds: float) -> None:
        """Run until this virtual time since power-on, what happens then included. Raises FirmwareError.

        A time that has passed already, or is now, leaves the board as it is.
        """
        if not isinstance(seconds, int | float) or not 0 <= seconds <= LONGEST_RUN_S:
            raise InputError(
                f"cannot run until {seconds!r} s; give the seconds since power-on, from 0 to {LONGEST_RUN_S}"
            )
        if to_ps(seconds) > self.clock.now_ps:
            self.run_until_ps(to_ps(seconds))

    def run_until_ps(self, at_ps: int) -> None:
        """Like ``run_until``, to the picosecond; for the other parts of this package."""
        self._run.until_ps(at_ps)

    def snapshot(self) -> Snapshot:
        """The state of everything on the board, for :meth:`restore`. Raises InputError with Python firmware.

        Between runs, not out of a callback. Serial links, trace files and whoever observes the trace are no
        part of it.
        """
        return Snapshot(self)

    def restore(self, snapshot: Snapshot) -> None:
        """Make everything as it was; a snapshot of this board may be restored as often as wanted."""
        snapshot.restore(self)

    def supply_current_ua(self) -> dict[str, float]:
        """What each sensor draws in microampere as firmware has configured it, by part name."""
        return self.sensors.supply_current_ua()

    def variable(self, name: str) -> Any:
        """A global variable of the firmware by its C name, such as ``acc`` or ``pitch``. Raises KeyError."""
        return self._run.backend.variable(name)

    def set_variable(self, name: str, value: Any) -> None:
        """Give a global variable of built firmware a value: a number, a sequence, a mapping of members.

        Raises KeyError as :meth:`variable` does, and InputError for what does not fit its C type.
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
        """Call a function of built firmware by its C name, and give its result.

        Numbers are passed by value; for a pointer give an address, a string, bytes, a structure's members (as
        mapping, object or sequence), or a sequence of what it points to. Lists, dictionaries, objects and
        byte arrays are brought up to what the function has written.

        Afterwards registers, RAM and all blocks are what they were; with ``keep``, what the function does
        stays. ``max_instructions`` bounds a function that only computes, which takes no virtual time;
        ``timeout_s`` (virtual) one that reaches a block or waits for an interrupt. Raises InputError for a
        function that cannot be called so (missing, inlined, static in several files, other arguments), and
        CallError for one that fails or does not return.

        The call begins wherever the firmware is just then: perhaps in an interrupt handler, in the middle of
        a transfer, which a driver that is called then finds busy.
        """
        return self._calls("call").call(name, arguments, keep, max_instructions, timeout_s)

    def scratch(self) -> AbstractContextManager[Scratch]:
        """A copy of the chip for calls that follow on each other, of which the board sees nothing."""
        return self._calls("scratch").scratch()

    def _calls(self, what: str) -> Caller:
        if self._caller is None:
            self._caller = self._built(what).caller(self._restoring)
        return self._caller

    def _built(self, what: str) -> ArmFirmware:
        if self.arm is None:
            raise InputError(f'{what} needs firmware built for the chip: Board(firmware="mylab.elf")')
        return self.arm

    @contextmanager
    def _restoring(self) -> Iterator[None]:
        saved = self.snapshot()
        try:
            yield
        finally:
            self.restore(saved)

    def _boot(self, choice: Choice, bus: I2CBus, spi: SpiBus, uart: Uart) -> Backend:
        self._end_firmware: Callable[[], object] = bool  # which does nothing
        if choice.image is not None:
            self.arm = self._power_chip(choice.image, bus, spi, uart)
            return self.arm
        core = Core(self.clock)
        hal = Hal(self.clock, self.trace, core, bus, uart, self.gpio)
        if choice.factory is None:
            return NoFirmware(self.clock, hal)
        self._end_firmware = weakref.finalize(self, core.close)
        return PythonFirmware(choice.factory(hal), core, hal)

    def _power_chip(self, image: FirmwareImage, bus: I2CBus, spi: SpiBus, uart: Uart) -> ArmFirmware:
        from emulator.chip.chip import Surroundings
        from emulator.chip.firmware import ArmFirmware

        around = Surroundings(self.clock, self.trace, self.gpio, uart, bus, spi, self.seed)
        return ArmFirmware(around, image)


class _Run:
    """The one way to let time pass on a board, until it is closed."""

    def __init__(self, backend: Backend) -> None:
        self.backend = backend
        self.closed = False

    def until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        if self.closed:
            raise InputError("this board has been closed and runs no more; make another one")
        self.backend.run_until_ps(at_ps)


def _load(scenario: str | Path | Scenario | None) -> Scenario | None:
    if scenario is None:
        return None
    from emulator.scenario import Scenario, load_scenario  # pydantic, which plain boards do without

    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
