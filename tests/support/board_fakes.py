"""Small firmwares for tests of the board. Each has one function and uses the same HAL as the lab's."""

from __future__ import annotations

from collections.abc import Callable

from fcu_emulator.emulator.python_cpu.hal import VirtualHal


class Script:
    """Firmware that runs ``main(hal)`` once and then idles. ``tick(hal)`` is its timer callback."""

    def __init__(
        self,
        hal: VirtualHal,
        main: Callable[[VirtualHal], None],
        tick: Callable[[VirtualHal], None] = lambda _hal: None,
    ) -> None:
        self.hal = hal
        self._main = main
        self._tick = tick

    def main(self) -> None:
        self._main(self.hal)
        while True:
            self.hal.HAL_Delay(1000)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        self._tick(self.hal)


def script(
    main: Callable[[VirtualHal], None], tick: Callable[[VirtualHal], None] = lambda _hal: None
) -> Callable[[VirtualHal], Script]:
    """Return a firmware for ``Board(firmware=...)``."""
    return lambda hal: Script(hal, main, tick)


def start_timer(hal: VirtualHal, prescaler: int = 83, period: int = 1249) -> None:
    """Start TIM9 with its interrupt, at 800 Hz by default."""
    hal.HAL_TIM_Base_Init(prescaler, period)
    hal.HAL_TIM_Base_Start_IT()
