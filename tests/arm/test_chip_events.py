"""The chip's time in C and the clock in Python agree: order of events, errors in callbacks."""

from __future__ import annotations

import pytest

from tests.support.arm.chip_fakes import NativeChip


def test_python_events_fire_while_chip_runs() -> None:
    chip = NativeChip()
    seen: list[int] = []
    for at_ps in (3_000, 1_000, 2_000):
        chip.clock.schedule(at_ps, lambda: seen.append(chip.clock.now_ps))
    chip.run_to(2_500)
    assert (seen, chip.clock.now_ps) == ([1_000, 2_000], 2_500)
    chip.run_for(500)
    assert (seen, chip.clock.now_ps) == ([1_000, 2_000, 3_000], 3_000)


def test_error_in_event_reaches_caller() -> None:
    chip = NativeChip()

    def fail() -> None:
        raise ValueError("in an event")

    chip.clock.schedule(1_000, fail)
    with pytest.raises(ValueError, match="in an event"):
        chip.run_to(5_000)
    chip.run_to(5_000)
    assert chip.clock.now_ps == 5_000


def test_python_peripheral_raises_and_lowers_interrupt() -> None:
    chip = NativeChip()
    chip.run_to(700)
    chip.fcu.set_irq(24, True)
    chip.fcu.set_irq(24, True)
    assert (chip.irq.rises, chip.fcu.irq_level(24)) == ([(700, 24)], True)
    chip.fcu.set_irq(24, False)
    assert not chip.fcu.irq_level(24)
