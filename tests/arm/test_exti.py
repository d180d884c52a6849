"""EXTI and SYSCFG: edges on pins become interrupts (RM0368 sections 7 and 10, table 38)."""

from __future__ import annotations

import pytest

from tests.support.arm.chip_fakes import NativeChip

IMR, EMR, RTSR, FTSR, SWIER, PR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
EXTICR1, EXTICR2 = 0x08, 0x0C
NUMBER = [6, 7, 8, 9, 10, *[23] * 5, *[40] * 6]  # by line


class Pins:
    """EXTI and SYSCFG of a chip, with its pins."""

    def __init__(self) -> None:
        self.chip = NativeChip()
        self.syscfg, self.exti = self.chip["SYSCFG"], self.chip["EXTI"]

    def listen(self, line: int, *, rising: bool = True, falling: bool = False) -> None:
        self.exti.write(RTSR, rising << line)
        self.exti.write(FTSR, falling << line)
        self.exti.write(IMR, 1 << line)


@pytest.fixture
def pins() -> Pins:
    return Pins()


@pytest.mark.parametrize("line", range(16))
def test_each_exti_line_has_interrupt_of_manual(pins: Pins, line: int) -> None:
    """RM0368 table 38. The pins are pulled low first, because PA13 and PA15 are pulled up after reset (8.4.4)."""
    pins.chip.gpio.drive("A", line, 0)
    pins.listen(line)
    pins.chip.gpio.drive("A", line, 1)
    assert pins.chip.irq.level(NUMBER[line])
    assert pins.exti.read(PR) == 1 << line
    pins.exti.write(PR, 1 << line)
    assert not pins.chip.irq.level(NUMBER[line])
    assert pins.exti.read(PR) == 0


@pytest.mark.parametrize(("rising", "falling", "seen"), [(True, False, 1), (False, True, 1), (True, True, 2)])
def test_only_selected_edges_raise_interrupt(pins: Pins, rising: bool, falling: bool, seen: int) -> None:
    pins.listen(4, rising=rising, falling=falling)
    for level in (1, 0):
        pins.chip.gpio.drive("A", 4, level)
        pins.exti.write(PR, 1 << 4)
    assert len(pins.chip.irq.rises) == seen


def test_exti_line_uses_port_selected_in_syscfg(pins: Pins) -> None:
    """RM0368 7.2.4: EXTICR2 has lines 4 to 7, and 2 selects port C."""
    pins.listen(4)
    pins.syscfg.write(EXTICR2, 2)
    pins.chip.gpio.drive("A", 4, 1)
    assert not pins.chip.irq.level(10)
    pins.chip.gpio.drive("C", 4, 1)
    assert pins.chip.irq.level(10)


def test_masked_edge_raises_interrupt_after_unmasking(pins: Pins) -> None:
    pins.exti.write(RTSR, 1)
    pins.chip.gpio.drive("A", 0, 1)
    assert not pins.chip.irq.level(6)
    pins.exti.write(IMR, 1)
    assert pins.chip.irq.level(6)


def test_software_can_raise_enabled_line(pins: Pins) -> None:
    """RM0368 10.3.5: SWIER sets PR if IMR is set, and clearing PR clears SWIER."""
    pins.exti.write(IMR, 1 << 9)
    pins.exti.write(SWIER, 1 << 9 | 1 << 3)
    assert pins.exti.read(PR) == 1 << 9
    assert pins.chip.irq.level(23)
    pins.exti.write(PR, 1 << 9)
    assert pins.exti.read(SWIER) == 1 << 3
    assert not pins.chip.irq.level(23)


def test_shared_interrupt_is_active_until_both_lines_cleared(pins: Pins) -> None:
    pins.exti.write(RTSR, 1 << 5 | 1 << 6)
    pins.exti.write(IMR, 1 << 5 | 1 << 6)
    pins.chip.gpio.drive("A", 5, 1)
    pins.chip.gpio.drive("A", 6, 1)
    pins.exti.write(PR, 1 << 5)
    assert pins.chip.irq.level(23)
    pins.exti.write(PR, 1 << 6)
    assert not pins.chip.irq.level(23)


def test_internal_exti_line_is_set_by_its_peripheral(pins: Pins) -> None:
    """Line 17 is the RTC alarm, interrupt 41."""
    pins.listen(17)
    pins.chip.fcu.set_exti_line(17, True)
    assert pins.chip.irq.level(41)


def test_reset_lowers_interrupt(pins: Pins) -> None:
    pins.listen(4)
    pins.chip.gpio.drive("A", 4, 1)
    pins.exti.reset()
    assert not pins.chip.irq.level(10)
    assert pins.exti.read(IMR) == 0


def test_exti_event_sets_no_pending_bit_without_edge(pins: Pins) -> None:
    """RM0368 10.3.2: EMR lets events through, and does not affect PR."""
    pins.exti.write(EMR, 0xFF_FFFF)
    assert pins.exti.read(EMR) == 0x7F_FFFF
    pins.chip.gpio.drive("A", 4, 1)
    assert (pins.exti.read(PR), pins.chip.notes(), pins.chip.irq.rises) == (0, [], [])


def test_debug_pull_ups_cause_no_edge(pins: Pins) -> None:
    """PA13 and PA15 have been high since reset (8.4.4). Selecting port A again does not cause an edge."""
    pins.exti.write(RTSR, 0xFFFF)
    pins.syscfg.write(EXTICR2, 0)
    assert pins.exti.read(PR) == 0


def test_memory_remapping_is_noted(pins: Pins) -> None:
    pins.syscfg.write(0x00, 1)
    assert pins.chip.problems() == {"remap": {}}


def test_compensation_cell_is_ready_at_once(pins: Pins) -> None:
    """RM0368 7.2.7: CMP_PD and READY."""
    pins.syscfg.write(0x20, 1)
    assert pins.syscfg.read(0x20) == 0x101
    pins.syscfg.write(0x20, 0)
    assert pins.syscfg.read(0x20) == 0


def test_button_causes_interrupt_at_press_and_release(pins: Pins) -> None:
    """RM0368 10.2.5: an edge of the pin sets the pending bit at its time."""
    gpio, clock = pins.chip.gpio, pins.chip.clock
    pins.chip["GPIOA"].write(0x0C, 1)  # PUPDR: pull-up at PA0
    pins.listen(0, rising=True, falling=True)
    gpio.press("A", 0, 0, clock.now_ps + 5_000_000)
    assert pins.exti.read(PR) == 1
    pins.exti.write(PR, 1)
    pins.chip.run_for(4_999_999)
    assert pins.exti.read(PR) == 0
    pins.chip.run_for(1)
    assert pins.exti.read(PR) == 1
