"""Former location of :mod:`fcu_emulator.emulator.testing.strategies`, for one release."""

from __future__ import annotations

import warnings
from typing import Any


def __getattr__(name: str) -> Any:
    from fcu_emulator.emulator.testing import strategies

    warnings.warn(
        "fcu_emulator.emulator.strategies is now fcu_emulator.emulator.testing.strategies; import that",
        DeprecationWarning,
        stacklevel=2,
    )
    return getattr(strategies, {"Motion": "GeneratedMotion"}.get(name, name))
