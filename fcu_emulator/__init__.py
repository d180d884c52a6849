"""A virtual STEVAL-FCU001V1: sensors, timer, UART and one physical world, in exact virtual time.

``from fcu_emulator import Board`` is what most course material needs. The public names are those of
:mod:`fcu_emulator.emulator`. This is the only installed package. It contains ``emulator``, ``sensors``,
``firmware_model`` and ``scenarios``; as top-level packages they were hidden by a student's files of the same name.

Decision: in a clone the four are top-level folders of the repository, and the package finds them by its search path.
The alternative, four folders inside this one, would make every path in the repository longer.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fcu_emulator.emulator import *  # noqa: F403

_HERE = os.path.dirname(__file__)  # noqa: PTH120  pathlib would be a third of this import's time
if not os.path.isdir(os.path.join(_HERE, "emulator")):  # noqa: PTH112, PTH118
    __path__.append(os.path.dirname(_HERE))  # noqa: F405, PTH120


_PARTS = ("emulator", "sensors", "firmware_model", "scenarios")


def __getattr__(name: str) -> Any:
    if not name.startswith("__") and name not in _PARTS:  # a part is imported as a submodule
        emulator = import_module("fcu_emulator.emulator")
        if name in emulator.__all__ or name in emulator.OLD_NAMES:
            return getattr(emulator, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *import_module("fcu_emulator.emulator").__all__})
