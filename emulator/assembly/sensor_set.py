"""A board's sensors, and their connection to their bus.

A sensor with a connected pin is evaluated whenever its pins may change. Other sensors are evaluated
only when they are read.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from fcu_emulator.emulator.boards.description import (
    BoardDescription,
    Matrix,
    MountedSensor,
    Numbers,
    SensorSettings,
    Wiring,
)
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.buses.spi import SpiBus
from fcu_emulator.emulator.clock import NEVER_PS, Clock, Event
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.trace import DeviceNote, GpioEdge, NoteValue, RegisterWrite, Trace
from fcu_emulator.emulator.world import World
from fcu_emulator.sensors.errors import PartErrors
from fcu_emulator.sensors.part import Sensor, Signal, SubaddressTarget
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register_file import NoteCallback, WriteLog


class SensorSet:
    """The sensors of one board, keyed by name: ``sensors["LSM6DSL"]``, or ``sensors.lsm6dsl``.

    ``powered_on_ps``: time of power-on; None if power-on was long ago. Raises InputError for
    settings of absent sensors.
    """

    def __init__(
        self,
        board: BoardDescription,
        world: World,
        clock: Clock,
        settings: SensorSettings,
        seed: int,
        powered_on_ps: int | None = None,
    ) -> None:
        _refuse_unknown(settings, board)
        self._clock = clock
        self.parts: tuple[Sensor, ...] = tuple(
            _build(mounted, world, settings, seed, powered_on_ps) for mounted in board.parts
        )
        self._by_name = {part.NAME: part for part in self.parts}
        vars(self).update((part.NAME.lower(), part) for part in self.parts)
        world.on_change(self._world_changed)

    def __getitem__(self, name: str) -> Sensor:
        try:
            return self._by_name[name]
        except KeyError:
            raise InputError(f"unknown sensor {name!r}; known: {', '.join(self._by_name)}") from None

    def __iter__(self) -> Iterator[Sensor]:
        return iter(self.parts)

    def __getattr__(self, name: str) -> Any:
        known = ", ".join(part.NAME.lower() for part in self.__dict__.get("parts", ()))
        raise AttributeError(f"unknown sensor {name!r} on this board; known: {known}")

    def attach(self, i2c: Mapping[str, I2CBus], spi: Mapping[str, SpiBus], wiring: Wiring) -> None:
        """Connect sensors to addresses and chip selects."""
        clock = self._clock
        for part in self.parts:
            place = wiring.places.get(part.NAME)
            if isinstance(place, int):
                i2c[wiring.bus].attach(place, SubaddressTarget(part, lambda: clock.now_ps))
            elif place is not None:
                spi[wiring.bus].attach(place, part)

    def observe(self, trace: Trace) -> None:
        """Report register accesses and pin edges to the trace."""
        for part in self.parts:
            PinWatch(part, self._clock, trace)
            part.observe(_note(trace, part.NAME), _write_log(trace, part.NAME))

    def supply_current_ua(self) -> dict[str, float]:
        return {part.NAME: part.supply_current_ua() for part in self.parts}

    def _world_changed(self, from_s: float) -> None:
        del from_s
        for part in self.parts:
            part.world_changed(self._clock.now_ps)


def _build(
    mounted: MountedSensor, world: World, settings: SensorSettings, seed: int, powered_on_ps: int | None
) -> Sensor:
    part = mounted.part
    errors = _replace(part.ERRORS.of_quality(settings.quality, seed), settings.figures.get(mounted.key, {}))
    signals: dict[str, Signal] = {}
    for quantity in part.SIGNALS:
        signal = world.sensed(quantity.name, one_row=quantity.one_row, heating=errors.heating)
        if quantity.axes == 3:
            signal = signal.turned(errors.mounted() @ _mounting(mounted, settings.mountings))
        signals[quantity.name] = signal
    return part.build(signals, errors, seed, powered_on_ps=powered_on_ps)


def _mounting(mounted: MountedSensor, chosen: Mapping[str, str]) -> Matrix:
    usual = next(iter(mounted.mountings))
    name = chosen.get(mounted.mounting_key, usual)
    if name not in mounted.mountings:
        known = ", ".join(mounted.mountings)
        raise InputError(f"unknown {mounted.mounting_key} {name!r}; known: {known}")
    return mounted.mountings[name]


def _refuse_unknown(settings: SensorSettings, board: BoardDescription) -> None:
    parts = [mounted.key for mounted in board.parts]
    for name in settings.figures:
        if name not in parts:
            raise InputError(f"unknown sensor {name!r}; known: {', '.join(parts)}")


def _note(trace: Trace, device: str) -> NoteCallback:
    def note(now_ps: int, what: str, problem: str, text: str, **data: NoteValue) -> None:
        trace.add(DeviceNote(now_ps, device, what, text, problem, data))

    return note


def _write_log(trace: Trace, device: str) -> WriteLog:
    def log(now_ps: int, register: str, old: int, new: int) -> None:
        if trace.detailed:
            trace.add_detail(RegisterWrite(now_ps, device, register, old, new))

    return log


def _replace(errors: PartErrors, numbers: Numbers) -> PartErrors:
    known = errors.figures()
    for name in numbers:
        if name not in known:
            raise InputError(f"unknown sensor figure {name!r}; known: {', '.join(known)}")
    try:
        return dataclasses.replace(errors, **numbers)
    except ValueError as error:
        raise InputError(str(error)) from None


class PinWatch:
    """Reporter of the edges of a sensor's pins. Listeners and trace get each edge at the time of the edge."""

    def __init__(self, part: Sensor, clock: Clock, trace: Trace) -> None:
        self._part = part
        self._clock = clock
        self._trace = trace
        self._event: Event | None = None
        self._at_ps: int = NEVER_PS
        for pin in part.pins():
            pin.on_wire = partial(self._wire, pin)

    def _wire(self, pin: Pin) -> None:
        self._part.catch_up(self._clock.now_ps)  # edges before this time are not reported
        pin.observe(partial(self._record, f"{self._part.NAME}.{pin.name}"))
        self._part.watch(self._arm)
        self._arm()

    def _record(self, name: str, at_ps: int, level: int) -> None:
        self._trace.add(GpioEdge(at_ps, name, level))

    def _arm(self) -> None:
        at_ps = self._part.next_event_ps()
        if at_ps == self._at_ps:
            return
        if self._event is not None:
            self._event.cancel()
            self._event = None
        self._at_ps = at_ps
        if at_ps < NEVER_PS:
            self._event = self._clock.schedule(at_ps, self._due)

    def _due(self) -> None:
        self._event, self._at_ps = None, NEVER_PS
        now_ps = self._clock.now_ps
        self._part.catch_up(now_ps)
        assert self._part.next_event_ps() > now_ps, f"{self._part.NAME} has not caught up"
        self._arm()
