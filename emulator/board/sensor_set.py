"""The board's three sensors: built from the world, deviating as asked, attached to their bus."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

from emulator.board.pin_watch import PinWatch
from emulator.boards.description import Numbers, Profile, SensorSettings
from emulator.boards.fcu001v1 import MAGNETOMETER_MOUNTING, MOUNTING, Matrix
from emulator.buses.i2c import I2CBus
from emulator.buses.spi import SpiBus
from emulator.errors import InputError
from emulator.time.clock import Clock
from emulator.trace import DeviceNote, RegisterWrite, Trace
from emulator.world import World
from sensors.lis2mdl import LIS2MDL, LIS2MDLErrors
from sensors.lps22hb import LPS22HB, LPS22HBErrors
from sensors.lsm6dsl import LSM6DSL, LSM6DSLErrors
from sensors.part import Part, Signal
from sensors.register_file import NoteCallback, WriteLog
from sensors.subaddress import SubaddressTarget

ErrorsT = TypeVar("ErrorsT", LSM6DSLErrors, LIS2MDLErrors, LPS22HBErrors)


class SensorSet:
    """The three parts of one board.

    ``powered_on_ps``: when they got their supply, None for long before the clock started.
    """

    def __init__(
        self,
        world: World,
        clock: Clock,
        settings: SensorSettings,
        seed: int,
        powered_on_ps: int | None = None,
    ) -> None:
        def turned(signal: Signal, mounting: Matrix) -> Signal:
            return lambda t_s: signal(t_s) @ mounting.T

        grade = settings.grade
        self.lsm6dsl = LSM6DSL(
            turned(world.sensed("acc"), MOUNTING),
            turned(world.sensed("gyro"), MOUNTING),
            world.sensed("temperature"),
            _replace(LSM6DSLErrors.of_grade(grade, seed), settings.lsm6dsl),
            seed,
            powered_on_ps=powered_on_ps,
        )
        self.lis2mdl = LIS2MDL(
            turned(world.magnetic_field_mgauss, MAGNETOMETER_MOUNTING[settings.magnetometer_mounting]),
            world.temperature_degc,
            _replace(LIS2MDLErrors.of_grade(grade, seed), settings.lis2mdl),
            seed,
            powered_on_ps=powered_on_ps,
        )
        self.lps22hb = LPS22HB(
            world.pressure_hpa,
            world.temperature_degc,
            _replace(LPS22HBErrors.of_grade(grade, seed), settings.lps22hb),
            seed,
            powered_on_ps=powered_on_ps,
        )
        self.parts: tuple[Part, ...] = (self.lsm6dsl, self.lis2mdl, self.lps22hb)
        world.on_change(self._world_changed)
        self._clock = clock

    def attach(self, i2c2: I2CBus, spi2: SpiBus, profile: Profile) -> None:
        """Solder the parts to their addresses and chip selects."""
        clock = self._clock
        for part in self.parts:
            if part.NAME in profile.i2c2:
                i2c2.attach(profile.i2c2[part.NAME], SubaddressTarget(part, lambda: clock.now_ps))
            if part.NAME in profile.spi2:
                spi2.attach(profile.spi2[part.NAME], part)

    def observe(self, trace: Trace) -> None:
        """Report what firmware does to the registers, and the edges of wired pins, to the trace."""
        for part in self.parts:
            PinWatch(part, self._clock, trace)
            part.observe(_note(trace, part.NAME), _write_log(trace, part.NAME))

    def supply_current_ua(self) -> dict[str, float]:
        """What each part draws in microampere as firmware has configured it, by its name."""
        return {part.NAME: part.supply_current_ua() for part in self.parts}

    def _world_changed(self, from_s: float) -> None:
        del from_s
        for part in self.parts:
            part.world_changed(self._clock.now_ps)


def _note(trace: Trace, device: str) -> NoteCallback:
    def note(now_ps: int, what: str, text: str) -> None:
        trace.add(DeviceNote(now_ps, device, what, text))

    return note


def _write_log(trace: Trace, device: str) -> WriteLog:
    def log(now_ps: int, register: str, old: int, new: int) -> None:
        if trace.detailed:
            trace.add_detail(RegisterWrite(now_ps, device, register, old, new))

    return log


def _replace(errors: ErrorsT, numbers: Numbers) -> ErrorsT:
    known = [entry.name for entry in dataclasses.fields(errors)]
    for name in numbers:
        if name not in known:
            raise InputError(f"unknown sensor figure {name!r}; known: {', '.join(known)}")
    try:
        return dataclasses.replace(errors, **numbers)
    except ValueError as error:
        raise InputError(str(error)) from None
