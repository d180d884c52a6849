"""A replay on recorded samples: the same firmware prints the recorded text, and another firmware does not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fcu_emulator import Board, InputError
from fcu_emulator.emulator.analysis.compare import compare, largest_deviations
from fcu_emulator.emulator.analysis.observation import END, TERMINAL, Observation, observe
from fcu_emulator.emulator.analysis.replay import replay
from fcu_emulator.emulator.assembly.firmware import FirmwareFactory, python_firmware
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.errors import I2CNackError
from fcu_emulator.emulator.python_cpu.hal import HAL_OK, VirtualHal
from fcu_emulator.emulator.scenario import scenario_names
from tests.support.board_fakes import script
from tests.support.scenario_files import IDEAL, write

LSM6DSL, LPS22HB = 0xD6, 0xBA


def recorded(
    scenario: str | Path, firmware: str | FirmwareFactory = "lab3", end_ps: int = 3 * PS_PER_S
) -> Board:
    board = Board(firmware=firmware, scenario=scenario)
    observe(board, end_ps, transfers=True)
    return board


def text_of(observation: Observation) -> str:
    return "".join(line.text for line in observation.sequences[TERMINAL])


@pytest.mark.parametrize("name", scenario_names())
def test_firmware_on_recorded_samples_prints_same_text(name: str) -> None:
    board = Board(firmware="lab3", scenario=name)
    original = observe(board, 5 * PS_PER_S, transfers=True)
    again = replay(board, python_firmware("lab3"))

    assert not compare(again, original)
    assert text_of(again) == text_of(original)


def test_template_on_recorded_samples_prints_same_text() -> None:
    board = Board(firmware="template", scenario="flat")
    original = observe(board, 2500 * PS_PER_MS, transfers=True)
    again = replay(board, python_firmware("template"))

    assert text_of(again) == text_of(original)
    assert [edge.text for edge in again.sequences["LED1"]] == ["on", "off", "on"]  # set up, off, toggled


def test_difference_in_final_digit_is_found() -> None:
    """mu, the weight of Gx in the slides' roll, has almost no effect on a flat board."""
    board = Board(firmware="lab3", scenario="flat")
    original = observe(board, 3 * PS_PER_S, transfers=True)
    changed = replay(board, python_firmware("lab3", {"mu": 0.5}))

    (difference,) = compare(changed, original)
    assert difference.sequence == TERMINAL
    assert 0 < largest_deviations(changed, original)["Roll"] < 1e-3


def test_early_led_change_is_difference() -> None:
    """Exercise 3b needs 80 degrees, not 60. The scenario first turns to 75."""
    board = Board(firmware="lab3", scenario="led_x")
    original = observe(board, 4 * PS_PER_S, transfers=True)

    (difference,) = compare(replay(board, python_firmware("lab3", {"led_threshold_deg": 60.0})), original)
    assert difference.sequence == "LED1"


def test_text_beyond_recording_is_omitted() -> None:
    board = recorded("flat", script(lambda hal: say(hal, "one\n")))

    assert text_of(replay(board, script(lambda hal: say(hal, "one\nand two\n")))) == "one\n"
    assert text_of(replay(board, script(lambda hal: say(hal, "on")))) == "on"


@pytest.mark.parametrize(
    ("printed", "replayed"),
    [("-0.000000", "0.000000"), ("0.000000", "-0.000000"), ("9.999999", "10.000000"), ("1", "1234.000000")],
)
def test_longer_number_does_not_delay_later_lines(printed: str, replayed: str) -> None:
    def saying(number: str) -> Callable[[VirtualHal], None]:
        def main(hal: VirtualHal) -> None:
            for _ in range(3):
                for text in ("*****\n\r\n\r", f"Altitude: {number} m \n\r", "*****\n\r"):
                    hal.HAL_UART_Transmit(text.encode(), 1000)
                hal.HAL_Delay(100)
            say(hal, "end\n")

        return main

    board = Board(script(saying(printed)), scenario="flat")
    original = observe(board, 3 * PS_PER_S, transfers=True)
    again = replay(board, script(saying(replayed)))

    assert [one.at_ps for one in again.sequences[TERMINAL]] == [
        one.at_ps for one in original.sequences[TERMINAL]
    ]
    assert text_of(again).replace(replayed, printed) == text_of(original)


def say(hal: VirtualHal, text: str) -> None:
    hal.HAL_UART_Transmit(text.encode("latin-1"), 1000)
    hal.HAL_Delay(10_000)


def test_endless_wait_ends_with_recording() -> None:
    def main(hal: VirtualHal) -> None:
        while True:
            hal.HAL_Delay(1000)

    assert not replay(recorded("flat"), script(main)).sequences[TERMINAL]


def test_recorded_bytes_may_be_read_in_one_transfer() -> None:
    """Over SPI2 the C firmware reads single bytes."""

    def in_two(hal: VirtualHal) -> None:
        for register, size in ((0x28, 2), (0x2A, 1)):
            assert hal.HAL_I2C_Mem_Read(LPS22HB, register, size)[0] == HAL_OK

    def in_one(hal: VirtualHal) -> None:
        status, data = hal.HAL_I2C_Mem_Read(LPS22HB, 0x28, 3)
        assert status == HAL_OK
        say(hal, data.hex())

    def recorded_main(hal: VirtualHal) -> None:
        in_two(hal)
        say(hal, "123456")

    board = recorded("flat", script(recorded_main))
    expected = board.i2c2.write_read(0x5D, b"\x28", 3).hex()  # nothing was measured: it has not changed

    assert text_of(replay(board, script(in_one))) == expected


def test_bus_with_faults_is_refused(tmp_path: Path) -> None:
    fault = (
        "[[timeline]]\ndo = 'inject_fault'\nkind = 'absent'\naddress = 'LIS2MDL'\nat = '1.5s'\nfor = '5ms'\n"
    )

    with pytest.raises(InputError, match=r" 1\.5") as refused:
        replay(recorded(write(tmp_path, IDEAL + fault)), python_firmware("lab3"))
    assert refused.value.kind == "bus_fault"
    assert str(I2CNackError(0x1E, 0)).partition(": ")[2] in str(refused.value)


def test_callbacks_with_other_reads_are_refused() -> None:
    class OnlyGyroscope:
        def __init__(self, hal: VirtualHal) -> None:
            self._hal = hal

        def main(self) -> None:
            self._hal.HAL_TIM_Base_Init(83, 1249)
            self._hal.HAL_TIM_Base_Start_IT()
            say(self._hal, "*" * 100)

        def HAL_TIM_PeriodElapsedCallback(self) -> None:
            self._hal.HAL_I2C_Mem_Read(LSM6DSL, 0x22, 6)

    with pytest.raises(InputError, match=r"0x0F.* LSM6DSL .*0x22") as refused:
        replay(recorded("flat"), OnlyGyroscope)
    assert refused.value.kind == "other_register"


def test_early_end_of_recorded_firmware_is_difference() -> None:
    def main(hal: VirtualHal) -> None:
        hal.HAL_UART_Transmit(b"one\n", 1000)
        raise ZeroDivisionError

    board = Board(firmware=script(main), scenario="flat")
    original = observe(board, PS_PER_S, transfers=True)

    (difference,) = compare(replay(board, script(lambda hal: say(hal, "one\n"))), original)
    assert difference.sequence == END
