"""A virtual STEVAL-FCU001V1: sensors, timer, UART and one physical world, in exact virtual time.

This package exports all documented names. Each is loaded on first use, so that ``fcu --help`` does not import numpy.
"""

from __future__ import annotations

if not __name__.startswith("fcu_emulator."):  # the package was imported by its old name
    from fcu_emulator._old_names import redirect

    redirect(__name__)

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.renamed import warn_renamed

if TYPE_CHECKING:
    from fcu_emulator.emulator.assembly.board import Board
    from fcu_emulator.emulator.assembly.firmware import python_firmware
    from fcu_emulator.emulator.buses.i2c import I2CFault
    from fcu_emulator.emulator.errors import (
        CallError,
        ExpectationError,
        FcuError,
        FirmwareError,
        FirmwareFileError,
        I2CBusError,
        I2CError,
        I2CNackError,
        I2CStuckError,
        InputError,
        LimitError,
        LinkError,
        NotJudgedError,
        OutputError,
        RecordingError,
        RubricError,
        ScenarioError,
        SymbolError,
    )
    from fcu_emulator.emulator.scenario import (
        ExpectationResult,
        Result,
        Scenario,
        check,
        load_scenario,
        run,
        scenario_names,
    )
    from fcu_emulator.emulator.trace import (
        BusTransfer,
        DeviceNote,
        Fault,
        GpioEdge,
        RegisterWrite,
        TerminalBytes,
        TickLate,
        TickLost,
        TraceEvent,
    )

_HOMES = (
    "fcu_emulator.emulator.errors",
    "fcu_emulator.emulator.trace",
    "fcu_emulator.emulator.buses.i2c",
    "fcu_emulator.emulator.assembly.firmware",
    "fcu_emulator.emulator.assembly.board",
    "fcu_emulator.emulator.scenario",
)
"""Modules that define the names; those that load quickly come first."""

__all__ = [
    "Board",
    "BusTransfer",
    "CallError",
    "DeviceNote",
    "ExpectationError",
    "ExpectationResult",
    "Fault",
    "FcuError",
    "FirmwareError",
    "FirmwareFileError",
    "GpioEdge",
    "I2CBusError",
    "I2CError",
    "I2CFault",
    "I2CNackError",
    "I2CStuckError",
    "InputError",
    "LimitError",
    "LinkError",
    "NotJudgedError",
    "OutputError",
    "RecordingError",
    "RegisterWrite",
    "Result",
    "RubricError",
    "Scenario",
    "ScenarioError",
    "SymbolError",
    "TerminalBytes",
    "TickLate",
    "TickLost",
    "TraceEvent",
    "check",
    "load_scenario",
    "python_firmware",
    "run",
    "scenario_names",
]


OLD_NAMES = dict.fromkeys(("Failure", "Finding", "Miss"), "ExpectationResult")


def __getattr__(name: str) -> Any:
    if name in OLD_NAMES:
        new = OLD_NAMES[name]
        warn_renamed(name, new)
        name = new
    if name in __all__:
        for home in map(import_module, _HOMES):
            if hasattr(home, name):
                return getattr(home, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
