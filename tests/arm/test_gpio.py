"""GPIO: outputs, inputs, pulls, open drain, the lock (RM0368 section 8), and pins with several drivers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.buses.gpio import Gpio, Led
from fcu_emulator.emulator.chip.library import FcuChip, NativePeripheral
from fcu_emulator.emulator.chip.peripherals.gpio import ConnectedPins
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import GpioEdge, Trace
from tests.support.arm.chip_fakes import NativeChip

MODER, OTYPER, PUPDR, IDR, ODR, BSRR, LCKR, AFRL = 0x00, 0x04, 0x0C, 0x10, 0x14, 0x18, 0x1C, 0x20
OUTPUT, ALTERNATE, ANALOG = 1, 2, 3


@pytest.fixture
def chip() -> NativeChip:
    return NativeChip()


@pytest.fixture
def port(chip: NativeChip) -> NativePeripheral:
    return chip["GPIOB"]


def mode(port: NativePeripheral, pin: int, value: int) -> None:
    port.write(MODER, value << 2 * pin, 3 << 2 * pin)


def edges(chip: NativeChip) -> list[tuple[str, int]]:
    return [(edge.pin, edge.level) for edge in chip.trace.of(GpioEdge)]


@pytest.mark.parametrize(
    ("name", "moder", "pupdr"),
    [("GPIOA", 0xA800_0000, 0x6400_0000), ("GPIOB", 0x280, 0x100), ("GPIOC", 0, 0)],
)
def test_registers_have_reset_values_of_manual(chip: NativeChip, name: str, moder: int, pupdr: int) -> None:
    """RM0368 8.4.1, 8.4.4: the debug port's pins are set up after reset."""
    port = chip[name]
    assert (port.read(MODER), port.read(PUPDR)) == (moder, pupdr)


def test_led_is_lit_by_low_output(chip: NativeChip, port: NativePeripheral) -> None:
    """ST's firmware: PB5 is active low. It is lit from MX_GPIO_Init on, because ODR is 0."""
    led = Led("LED1", chip.gpio, "B", 5)
    assert not led.on
    mode(port, 5, OUTPUT)
    assert led.on
    port.write(BSRR, 1 << 5)
    assert not led.on
    port.write(BSRR, 1 << 21)
    assert led.on
    assert edges(chip) == [("PB5", 0), ("PB5", 1), ("PB5", 0)]


def test_set_wins_over_reset_in_one_write(port: NativePeripheral) -> None:
    """RM0368 8.4.7."""
    port.write(BSRR, 1 << 5 | 1 << 21)
    assert port.read(ODR) == 1 << 5
    assert port.read(BSRR) == 0


def test_half_word_access_affects_only_its_half(port: NativePeripheral) -> None:
    port.write(BSRR, 0x0021_0000, 0xFFFF_0000)
    port.write(ODR, 0x0000_FF00, 0x0000_FF00)
    port.write(BSRR, 0x8000_0000, 0xFFFF_0000)
    assert port.read(ODR) == 0x7F00


def test_open_drain_output_lights_led_like_push_pull(chip: NativeChip, port: NativePeripheral) -> None:
    """ST's firmware: MX_GPIO_Init makes the LED pins open drain."""
    led = Led("LED2", chip.gpio, "B", 4)
    port.write(OTYPER, 1 << 4)
    mode(port, 4, OUTPUT)
    assert led.on
    port.write(BSRR, 1 << 4)
    assert not led.on
    assert edges(chip)[-1] == ("PB4", 1)


def test_pin_without_output_mode_leaves_led_dark(chip: NativeChip, port: NativePeripheral) -> None:
    led = Led("LED1", chip.gpio, "B", 5)
    mode(port, 5, OUTPUT)
    mode(port, 5, 0)
    assert not led.on
    assert edges(chip) == [("PB5", 0), ("PB5", 1)]


def test_input_reads_level_of_its_driver(chip: NativeChip, port: NativePeripheral) -> None:
    chip.gpio.drive("B", 7, 1)
    assert port.read(IDR) >> 7 & 1 == 1
    chip.gpio.drive("B", 7, None)
    assert port.read(IDR) >> 7 & 1 == 0


def test_pull_resistor_determines_level_without_driver(chip: NativeChip, port: NativePeripheral) -> None:
    port.write(PUPDR, 1 << 14, 3 << 14)
    assert port.read(IDR) >> 7 & 1 == 1
    chip.gpio.drive("B", 7, 0)
    assert port.read(IDR) >> 7 & 1 == 0
    chip.gpio.drive("B", 7, None)
    assert chip.gpio.level("B", 7) == 1
    port.write(PUPDR, 2 << 14, 3 << 14)
    assert chip.gpio.level("B", 7) == 0
    assert chip.gpio.driven("B", 7) is None


def test_output_is_read_back_through_idr(port: NativePeripheral) -> None:
    mode(port, 3, OUTPUT)
    port.write(BSRR, 1 << 3)
    assert port.read(IDR) >> 3 & 1 == 1


def test_analog_pin_reads_zero(chip: NativeChip, port: NativePeripheral) -> None:
    """RM0368 8.3.12."""
    chip.gpio.drive("B", 1, 1)
    assert port.read(IDR) & 2
    mode(port, 1, ANALOG)
    assert not port.read(IDR) & 2
    mode(port, 1, 0)
    assert port.read(IDR) & 2


def test_alternate_function_releases_pin(chip: NativeChip, port: NativePeripheral) -> None:
    mode(port, 5, OUTPUT)
    port.write(AFRL, 2 << 20)
    mode(port, 5, ALTERNATE)
    assert chip.gpio.alternate("B", 5) == 2
    assert chip.gpio.driven("B", 5) is None
    port.write(AFRL, 5 << 20)
    assert chip.gpio.alternate("B", 5) == 5
    mode(port, 5, 0)
    assert chip.gpio.alternate("B", 5) is None


def test_locked_pins_keep_their_set_up_until_reset(port: NativePeripheral) -> None:
    """RM0368 8.4.8: LCKK is written as 1, 0, 1 with the same pins."""
    mode(port, 5, OUTPUT)
    for value in (1 << 16 | 1 << 5, 1 << 5, 1 << 16 | 1 << 5):
        port.write(LCKR, value)
    assert port.read(LCKR) == 1 << 16 | 1 << 5
    port.write(MODER, 0)
    port.write(AFRL, 0xFFFF_FFFF)
    assert port.read(MODER) == OUTPUT << 10
    assert port.read(AFRL) == 0xFF0F_FFFF
    port.write(BSRR, 1 << 5)
    assert port.read(ODR) == 1 << 5
    port.reset()
    port.write(MODER, 0)
    assert port.read(MODER) == 0


@pytest.mark.parametrize("middle", [1 << 6, 1 << 16 | 1 << 5])
def test_broken_lock_sequence_locks_nothing(port: NativePeripheral, middle: int) -> None:
    for value in (1 << 16 | 1 << 5, middle, 1 << 16 | 1 << 5):
        port.write(LCKR, value)
    assert not port.read(LCKR) >> 16


def test_each_listener_gets_edge_once(chip: NativeChip, port: NativePeripheral) -> None:
    heard = list[tuple[str, int]]()
    chip.gpio.listen("B", 7, lambda level: heard.append(("first", level)))
    chip.gpio.listen("B", 7, lambda level: heard.append(("second", level)))
    chip.gpio.drive("B", 7, 1, by="button")
    chip.gpio.drive("B", 7, 1, by="sensor")
    chip.gpio.drive("B", 7, None, by="button")
    assert heard == [("first", 1), ("second", 1)]


def test_pin_levels_before_connecting_chip_are_kept() -> None:
    """Sensors pull their chip selects up before the chip is connected."""
    heard = list[int]()
    clock, trace = Clock(), Trace()
    gpio = Gpio(clock, trace)
    gpio.drive("B", 12, 1, by="pull-up of the part")
    gpio.listen("B", 12, heard.append)
    gpio.frequent("B", 12)
    fcu = FcuChip(clock, trace)
    ConnectedPins(fcu, gpio)
    assert fcu.peripherals["GPIOB"].read(IDR) >> 12 & 1 == 1
    mode(fcu.peripherals["GPIOB"], 12, OUTPUT)
    assert (heard[-1], gpio.reads("B", 12), len(trace)) == (0, 0, 0)


def test_listener_may_drive_another_pin(chip: NativeChip, port: NativePeripheral) -> None:
    chip.gpio.listen("B", 6, lambda level: chip.gpio.drive("B", 7, level))
    mode(port, 6, OUTPUT)
    port.write(BSRR, 1 << 6)
    assert port.read(IDR) >> 6 & 3 == 3


def test_error_in_listener_reaches_caller(chip: NativeChip, port: NativePeripheral) -> None:
    def fail(_level: int) -> None:
        raise ValueError("in a listener")

    chip.gpio.listen("B", 6, fail)
    port.write(BSRR, 1 << 6)
    with pytest.raises(ValueError, match="in a listener"):
        mode(port, 6, OUTPUT)
    assert chip.gpio.level("B", 6) == 1


def test_only_detailed_trace_contains_edges_of_frequent_pin(chip: NativeChip, port: NativePeripheral) -> None:
    chip.gpio.frequent("B", 12)
    mode(port, 12, OUTPUT)
    assert edges(chip) == []
    chip.trace.record_all()
    port.write(BSRR, 1 << 12)
    assert edges(chip) == [("PB12", 1)]


DRIVES = st.lists(st.sampled_from([None, 0, 1]), min_size=2, max_size=2)


@given(st.sampled_from(["input", "push-pull", "open drain"]), st.integers(0, 1), st.integers(0, 2), DRIVES)
def test_lowest_strong_driver_wins_over_pull(
    kind: str, latch: int, pull: int, outside: list[int | None]
) -> None:
    chip = NativeChip()
    port = chip["GPIOC"]
    port.write(OTYPER, int(kind == "open drain"))
    port.write(PUPDR, pull)
    port.write(ODR, latch)
    mode(port, 0, int(kind != "input"))
    for number, level in enumerate(outside):
        chip.gpio.drive("C", 0, level, by=str(number))
    strong = [level for level in outside if level is not None]
    if kind == "push-pull" or (kind == "open drain" and not latch):
        strong.append(latch)
    expected = min(strong) if strong else (None, 1, 0)[pull]
    assert chip.gpio.level("C", 0) == expected
    assert port.read(IDR) == (expected or 0)
