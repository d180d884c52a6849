"""A chip without a core for tests of one peripheral, with a real clock, trace and pins. Interrupt lines are recorded.

::

    chip = Chip()
    block = Dbgmcu(chip.soc, "DBGMCU", 0xE004_2000)
    block.write(0x04, 1)
    chip.run_to(1_000_000)      # picoseconds; fires what is due, as the core does before an access
"""

from __future__ import annotations

from collections.abc import Callable

from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.chip.library import FcuChip, NativePeripheral
from fcu_emulator.emulator.chip.peripherals.adc import Adc
from fcu_emulator.emulator.chip.peripherals.gpio import ConnectedPins
from fcu_emulator.emulator.chip.peripherals.peripheral import Soc
from fcu_emulator.emulator.chip.peripherals.tim import Timer, connect_timers
from fcu_emulator.emulator.chip.registers.dma import REQUESTS
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import DeviceNote, NoteValue, Trace


class FakeClockTree:
    """Frequencies as the lab's firmware sets them up, unless a test changes them."""

    def __init__(self) -> None:
        self.sysclk_hz = self.hclk_hz = self.pclk2_hz = self.timer1_hz = self.timer2_hz = 84_000_000
        self.pclk1_hz = self.nominal_pclk1_hz = 42_000_000
        self.lsi_hz = self.lse_hz = 0
        self._changed: list[Callable[[], None]] = []

    def on_change(self, changed: Callable[[], None]) -> None:
        self._changed.append(changed)

    def set(self, **frequencies_hz: int) -> None:
        """Set frequencies, as in ``set(pclk1_hz=16_000_000)``, and call all listeners as after a write to RCC."""
        nominal_hz = frequencies_hz.get("pclk1_hz", self.nominal_pclk1_hz)
        vars(self).update({"nominal_pclk1_hz": nominal_hz} | frequencies_hz)
        for changed in self._changed:
            changed()


class FakeInterrupts:
    """Interrupt inputs: their present levels, and the number of rising edges of each."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._levels: dict[int, bool] = {}
        self.rises: list[tuple[int, int]] = []
        """(time in ps, number) of every change from inactive to active."""

    def set_line(self, number: int, level: bool) -> None:
        if level and not self._levels.get(number, False):
            self.rises.append((self._clock.now_ps, number))
        self._levels[number] = level

    def level(self, number: int) -> bool:
        return self._levels.get(number, False)


class Chip:
    """The surroundings of a peripheral. ``resets``: the reasons given to ``soc.reset``, with their times."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.trace = Trace()
        self.gpio = Gpio(self.clock, self.trace)
        self.clocks = FakeClockTree()
        self.irq = FakeInterrupts(self.clock)
        self.resets: list[tuple[int, str]] = []
        self.soc = Soc(self.clock, self.trace, self.gpio, self._reset)
        self.soc.clocks, self.soc.irq = self.clocks, self.irq

    def run_to(self, at_ps: int) -> None:
        """Let time pass until ``at_ps``, and fire the events that are due."""
        self.clock.advance_to(at_ps)

    def run_for(self, duration_ps: int) -> None:
        """Let ``duration_ps`` pass."""
        self.clock.advance_to(self.clock.now_ps + duration_ps)

    def notes(self) -> list[tuple[str, str]]:
        """Return (what, text) of every note so far."""
        return [(note.what, note.text) for note in self.trace.of(DeviceNote)]

    def problems(self) -> dict[str, dict[str, NoteValue]]:
        """Return the values of each problem that was noted, by its name."""
        return {note.problem: dict(note.data) for note in self.trace.of(DeviceNote)}

    def _reset(self, reason: str) -> None:
        self.resets.append((self.clock.now_ps, reason))


class NativeChip:
    """The same for peripherals in C, without a core that executes: ``chip["TIM9"].write(0x00, 1)``."""

    def __init__(
        self,
        clock: Clock | None = None,
        trace: Trace | None = None,
        clocks: FakeClockTree | None = None,
        irq: FakeInterrupts | None = None,
    ) -> None:
        self.clock = clock or Clock()
        self.trace = Trace() if trace is None else trace
        self.fcu = FcuChip(self.clock, self.trace)
        self.gpio = Gpio(self.clock, self.trace)
        ConnectedPins(self.fcu, self.gpio)
        self.clocks = clocks or FakeClockTree()
        self.clocks.on_change(lambda: self.fcu.set_clocks(self.clocks))
        self.fcu.set_clocks(self.clocks)
        self.irq = irq or FakeInterrupts(self.clock)
        self.fcu.watch_irqs(self.irq.set_line)
        connect_timers(self.fcu)

    def __getitem__(self, name: str) -> NativePeripheral:
        return self.fcu.peripherals[name]

    def timer(self, name: str) -> Timer:
        """Return a timer with its tick counts."""
        block = self.fcu.peripherals[name]
        assert isinstance(block, Timer)
        return block

    @property
    def adc(self) -> Adc:
        """ADC1 with its voltages."""
        block = self.fcu.peripherals["ADC1"]
        assert isinstance(block, Adc)
        return block

    @property
    def next_ps(self) -> int:
        """Return the time of the earliest event of the chip or of the clock."""
        chip_ps: int = self.fcu.library.fcu_next_event(self.fcu.handle)
        return min(self.clock.next_ps, chip_ps)

    def run_to(self, at_ps: int) -> None:
        """Let time pass until ``at_ps``, and fire the events that are due."""
        self.fcu.advance_to(at_ps)

    def run_for(self, duration_ps: int) -> None:
        """Let ``duration_ps`` pass."""
        self.fcu.advance_to(self.clock.now_ps + duration_ps)

    def notes(self) -> list[tuple[str, str]]:
        """Return (what, text) of every note so far."""
        return [(note.what, note.text) for note in self.trace.of(DeviceNote)]

    def problems(self) -> dict[str, dict[str, NoteValue]]:
        """Return the values of each problem that was noted, by its name."""
        return {note.problem: dict(note.data) for note in self.trace.of(DeviceNote)}


class DmaLines:
    """Request lines of DMA1 and DMA2, by the names of RM0368 tables 28 and 29."""

    def __init__(self, chip: FcuChip) -> None:
        self._chip = chip

    def request(self, line: str) -> bool:
        """Request one transfer, and return whether a stream has made it."""
        self._chip.enter()
        served = bool(self._chip.library.fcu_dma_request(self._chip.handle, _number(line)))
        self._chip.raise_error()
        return served

    def remaining(self, line: str) -> int:
        """Return NDTR of the stream that serves the line; 0 if no stream serves it."""
        count: int = self._chip.library.fcu_dma_remaining(self._chip.handle, _number(line))
        return count


def _number(line: str) -> int:
    return 1 + REQUESTS.index(line)
