"""Selection of a board's firmware and wiring, and execution of the firmware.

CubeMX names a handle after its peripheral (``hspi2``, ``hi2c2``). The handles that the firmware
contains select the wiring.

Decision: a firmware with handles of both buses, or without symbols, is tried on each wiring, first
on the usual wiring. The first wiring on which a sensor answers is used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from fcu_emulator.emulator.boards.description import BoardDescription, Wiring
from fcu_emulator.emulator.clock import TickCounts
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.python_cpu.cpu import PythonCpu
from fcu_emulator.emulator.python_cpu.hal import HostedApplication, VirtualHal

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.image import FirmwareImage, Symbols

FirmwareFactory: TypeAlias = Callable[[VirtualHal], HostedApplication]
Settings: TypeAlias = Mapping[str, Any]

_SETTINGS_IGNORED = "the scenario's [firmware_settings] are ignored: they are for firmware in Python"


# -- selection of the firmware and its wiring ---------------------------------------------------------------


@dataclass(frozen=True)
class Choice:
    """The chosen firmware: ``factory`` (Python), ``image`` (ARM), or none."""

    wiring: Wiring
    name: str = ""
    """The firmware's name for the user."""
    reason: str = ""
    """Reason for this wiring, if it is neither the usual wiring nor the user's choice."""
    notes: tuple[str, ...] = ()
    """Notes for the user, one line each."""
    factory: FirmwareFactory | None = None
    image: FirmwareImage | None = None


def choose(
    board: BoardDescription,
    firmware: str | Path | FirmwareFactory | None,
    name: str | None,
    settings: Settings | None = None,
    reaches_sensors: Callable[[Wiring], bool] = lambda _wiring: False,
) -> Choice:
    """Return the firmware and its wiring. Raises InputError.

    ``name``: the wiring's name, or None to select a wiring. ``reaches_sensors`` returns whether a sensor
    answers on a wiring. ``settings`` are for Python firmware.
    """
    wiring = board.wiring(name)
    if firmware is None:
        return Choice(wiring)
    if isinstance(firmware, str) and firmware in board.python_firmware:
        return _python(board, python_firmware(firmware, settings), firmware, wiring)
    if isinstance(firmware, str | Path):
        choice = _built(board, firmware, wiring, reaches_sensors if name is None else None)
        return replace(choice, notes=(*choice.notes, _SETTINGS_IGNORED)) if settings else choice
    if not callable(firmware):
        raise InputError(
            f"firmware must be a name, a file, or a callable that takes the HAL, not {firmware!r}"
        )
    return _python(board, firmware, getattr(firmware, "__name__", "own firmware"), wiring)


def python_firmware(name: str, settings: Settings | None = None) -> FirmwareFactory:
    """Return a Python firmware by name. Raises InputError."""
    from fcu_emulator.firmware_model import FIRMWARES
    from fcu_emulator.firmware_model import Settings as FirmwareSettings

    if name not in FIRMWARES:
        raise InputError(f"unknown firmware {name!r}; known: {', '.join(FIRMWARES)}", kind="unknown_firmware")
    try:
        chosen = FirmwareSettings(**dict(settings or {}))
    except (TypeError, ValueError) as error:
        raise InputError(f"firmware settings: {error}") from error
    return lambda hal: FIRMWARES[name](hal, chosen)


def _python(board: BoardDescription, factory: FirmwareFactory, name: str, wiring: Wiring) -> Choice:
    if wiring.bus not in board.i2c:
        fitting = [one for one in board.wirings if one.bus in board.i2c]
        use = " or ".join(f'wiring "{one.name}"' for one in fitting) or "a board with such a bus"
        buses = ", ".join(one.bus for one in fitting) or "an I2C bus"
        raise InputError(
            f"cannot run firmware in Python with wiring {wiring.name!r}: it uses the sensors on {buses}; "
            f"use {use}, or no firmware",
            kind="wrong_wiring",
        )
    return Choice(wiring, name, factory=factory)


def _built(
    board: BoardDescription,
    firmware: str | Path,
    usual: Wiring,
    reaches_sensors: Callable[[Wiring], bool] | None,
) -> Choice:
    from fcu_emulator.emulator.chip.image import load_firmware

    if isinstance(firmware, str) and firmware in board.built_firmware:
        from fcu_emulator.firmware_model.arm import prebuilt

        program, _ = board.built_firmware[firmware]
        return Choice(usual, firmware, image=load_firmware(prebuilt(program, usual.bus)))
    if not _is_file(firmware):
        known = f"known: {', '.join(board.firmware)}; or give" if board.firmware else "give"
        raise InputError(
            f"unknown firmware {str(firmware)!r}; {known} an ELF, HEX or BIN file", kind="unknown_firmware"
        )
    image, reason = load_firmware(firmware), ""
    wiring = usual
    if reaches_sensors is not None:
        wanted, why = _wanted_wiring(board, image.symbols)
        if wanted is None:
            wanted, why = _tried_out(board, usual, reaches_sensors)
        if wanted is not None and wanted is not usual:
            wiring, reason = wanted, why
    return Choice(wiring, str(firmware), reason, image.notes, image=image)


def _is_file(firmware: str | Path) -> bool:
    if isinstance(firmware, Path):
        return True
    return any(mark in firmware for mark in "./\\") or Path(firmware).exists()


def _wanted_wiring(board: BoardDescription, symbols: Symbols | None) -> tuple[Wiring | None, str]:
    if symbols is None:
        return None, ""
    found = [(one, name) for one in board.wirings for name in one.symbols if name in symbols]
    wanted = {one.name for one, _ in found}
    if len(wanted) != 1:
        return None, ""
    wiring, symbol = found[0]
    others = " or ".join(other.bus for other in board.wirings if other.symbols and other is not wiring)
    return (
        wiring,
        f"the firmware has {symbol}, a handle of {wiring.bus}, and no handle of {others or 'another bus'}",
    )


def _tried_out(
    board: BoardDescription, usual: Wiring, reaches_sensors: Callable[[Wiring], bool]
) -> tuple[Wiring | None, str]:
    others = [one for one in board.wirings if one is not usual]
    if not others or reaches_sensors(usual):
        return None, ""
    for wiring in others:
        if reaches_sensors(wiring):
            return wiring, f"in a trial run a sensor answered on {wiring.bus}, but no sensor on {usual.bus}"
    return None, ""


# -- execution ----------------------------------------------------------------------------------------------


class Backend(Protocol):
    """Interface for the execution of firmware."""

    @property
    def timer(self) -> TickCounts: ...

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        ...

    def variable(self, name: str) -> Any:
        """Return a C variable by name. Raises KeyError."""
        ...

    def handles(self, peripheral: str) -> bool:
        """Return whether the firmware is handling a peripheral's interrupt."""
        ...


class PythonFirmware:
    """Firmware written in Python, on the HAL."""

    def __init__(self, application: HostedApplication, cpu: PythonCpu, hal: VirtualHal) -> None:
        self._application = application
        self._cpu = cpu
        self.timer: TickCounts = hal.timer
        hal.link(application)
        cpu.boot(application.main)

    def run_until_ps(self, at_ps: int) -> None:
        self._cpu.run_until_ps(at_ps)

    def handles(self, peripheral: str) -> bool:
        return peripheral == self.timer.name and self._cpu.in_interrupt

    def variable(self, name: str) -> Any:
        try:
            return getattr(self._application, name)
        except AttributeError:
            raise KeyError(name) from None
