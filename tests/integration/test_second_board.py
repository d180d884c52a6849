"""A board other than the lab's, made according to docs/recipes.md: its single file defines everything."""

from __future__ import annotations

import gc
import json
import weakref
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator import Board, I2CNackError, InputError, ScenarioError, load_scenario, run
from fcu_emulator.emulator.boards.description import (
    BoardDescription,
    CallbackTimer,
    I2cPins,
    MountedSensor,
    SerialLine,
    Wiring,
)
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.scenario import json_schema
from fcu_emulator.firmware_model.arm import prebuilt
from fcu_emulator.sensors import LSM6DSL
from tests.support.recipe import GreenhouseBoard
from tests.support.words import Words

GREENHOUSE: BoardDescription = GreenhouseBoard.description
HTX221_AT, LPS22HB_AT = 0x5F, 0x5C
HEAD = 'schema = 1\nquestion = "Does the other board play it, too?"\nduration = "2s"\n'


class Hygrometer:
    """Firmware in Python on the HAL that prints the humidity in its timer's callback, ten times a second."""

    def __init__(self, hal: Any) -> None:
        self.hal = hal
        self.humidity = 0.0

    def main(self) -> None:
        self.hal.HAL_GPIO_Init("A", 5)
        self.hal.HAL_I2C_Mem_Write(HTX221_AT << 1, 0x20, b"\x83")
        self.hal.HAL_TIM_Base_Init(8399, 999)
        self.hal.HAL_TIM_Base_Start_IT()
        while True:
            self.hal.HAL_Delay(1000)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        _, data = self.hal.HAL_I2C_Mem_Read(HTX221_AT << 1, 0xA8, 2)
        self.humidity = int.from_bytes(data, "little") / 256 if data else -1.0
        self.hal.HAL_UART_Transmit(b"%d\n" % round(self.humidity), 100)
        self.hal.HAL_GPIO_WritePin("A", 5, self.humidity < 80)


def scenario(folder: Path, text: str) -> Path:
    file = folder / "case.toml"
    file.write_text(HEAD + text, encoding="utf-8")
    return file


def test_sensors_answer_at_their_addresses() -> None:
    board = GreenhouseBoard(ideal=True)
    assert board.i2c1.write_read(HTX221_AT, b"\x0f", 1) == b"\xbd"
    assert board.i2c1.write_read(LPS22HB_AT, b"\x0f", 1) == b"\xb1"
    with pytest.raises(I2CNackError):
        board.i2c1.read(0x6B, 1)
    assert [part.NAME for part in board.sensors] == ["HTX221", "LPS22HB"]


def test_burst_increments_only_with_bit_7() -> None:
    board = GreenhouseBoard(ideal=True)
    board.world.set_humidity(62.5)
    board.world.set_temperature(21.25)
    board.i2c1.write(HTX221_AT, b"\x20\x83")
    board.run_for(0.1)
    raw = board.i2c1.write_read(HTX221_AT, b"\xa8", 4)
    assert int.from_bytes(raw[:2], "little") / 256 == 62.5
    assert int.from_bytes(raw[2:], "little") / 64 == 21.25
    assert board.i2c1.write_read(HTX221_AT, b"\x29", 3) == raw[1:2] * 3
    assert board.i2c1.write_read(LPS22HB_AT, b"\x0f", 2)[0] == 0xB1  # its neighbour goes on by itself


def test_unknown_sensor_attribute_error_lists_known_attributes() -> None:
    board = GreenhouseBoard()
    assert board.led("GREEN") is board.green
    assert board.i2c() is board.i2c("I2C1") is board.i2c1
    assert board.timer is board.tim10
    for name in ("led1", "i2c2", "tim9"):
        with pytest.raises(AttributeError, match="the greenhouse has green, i2c1, tim10"):
            getattr(board, name)
    with pytest.raises(InputError, match="unknown LED 'LED1'; known: GREEN"):
        board.led("LED1")
    with pytest.raises(InputError, match="this board has no SPI bus"):
        board.spi()
    with pytest.raises(InputError, match=r"'lab3'.*: greenhouse") as unknown:
        GreenhouseBoard(wiring="lab3")
    assert unknown.value.kind == "unknown_wiring"
    with pytest.raises(InputError, match="unknown sensor 'LSM6DSL'; known: HTX221, LPS22HB"):
        board.sensors["LSM6DSL"]
    with pytest.raises(
        AttributeError, match="unknown sensor 'lsm6dsl' on this board; known: htx221, lps22hb"
    ):
        _ = board.sensors.lsm6dsl


def test_python_firmware_uses_bus_terminal_led_and_timer() -> None:
    board = GreenhouseBoard(Hygrometer, ideal=True)
    board.world.set_humidity(70)
    board.run_for(1.05)
    assert board.terminal.text.endswith("70\n")
    assert not board.green.on
    assert (board.tim10.name, board.tim10.rate_hz, board.tim10.lost) == ("TIM10", 10.0, 0)
    board.world.set_humidity(90)
    board.run_for(0.3)
    assert board.green.on
    assert board.terminal.uart.name == "USART2"


def test_firmware_for_another_board_is_explained(words: Words) -> None:
    board = GreenhouseBoard(prebuilt("template", "I2C2"))
    board.run_for(0.1)
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()
    assert diagnosis is not None
    assert "I2C2" in diagnosis.summary
    words("run", diagnosis.summary)
    (told,) = [line for line in str(diagnosis).splitlines() if "greenhouse" in line]
    assert "I2C1" in told
    words("run", told)
    assert board.terminal.text == ""  # it prints to USART1, which has no terminal


def test_scenario_moves_board_and_judges_output(tmp_path: Path) -> None:
    file = scenario(
        tmp_path,
        """
        [world]
        humidity_percent = 70
        [sensors]
        quality = "ideal"
        [[timeline]]
        at = "1s"
        do = "set_humidity"
        humidity_percent = 90
        [[expect]]
        kind = "led"
        led = "green"
        state = "off"
        from = "200ms"
        to = "1s"
        [[expect]]
        kind = "led"
        led = "green"
        state = "on"
        from = "1300ms"
        [[expect]]
        kind = "ticks"
        rate_hz = 10
        lost_max = 0
        [[expect]]
        kind = "never"
        pattern = "-1"
        """,
    )
    result = run(GreenhouseBoard(Hygrometer, scenario=file))
    assert result.passed, result.lines


def test_scenario_fault_accepts_sensor_name_as_address(tmp_path: Path) -> None:
    file = scenario(
        tmp_path,
        """
        [[timeline]]
        at = "500ms"
        do = "inject_fault"
        kind = "absent"
        address = "HTX221"
        for = "1s"
        [[expect]]
        kind = "never"
        pattern = "^-1$"
        """,
    )
    result = run(GreenhouseBoard(Hygrometer, scenario=file))
    assert [finding.key for finding in result.findings] == ["expect[0]"]


@pytest.mark.parametrize(
    ("text", "key", "says"),
    [
        ('[[expect]]\nkind = "led"\nled = "led1"\nstate = "on"', "expect[0].led", "must be 'green'"),
        (
            '[[timeline]]\ndo = "inject_fault"\nkind = "absent"\naddress = "LSM6DSL"',
            "timeline[0].address",
            '"HTX221"',
        ),
        (
            "[sensors.lsm6dsl]\nacc_noise_ug_rthz = 1",
            "sensors.lsm6dsl",
            "known here: quality, htx221, lps22hb",
        ),
        ('[sensors]\nmagnetometer_mounting = "parallel"', "sensors.magnetometer_mounting", "unknown key"),
        (
            "[sensors.htx221]\nhumidity_noise_percent = -1",
            "sensors.htx221.humidity_noise_percent",
            "at least 0",
        ),
        ('firmware = "lab3"', "firmware", "known: "),
    ],
)
def test_scenario_for_another_board_is_refused(tmp_path: Path, text: str, key: str, says: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        GreenhouseBoard(scenario=scenario(tmp_path, text))
    assert caught.value.key == key
    assert says in caught.value.problem


def test_errors_of_sensor_can_be_set_in_scenario(tmp_path: Path) -> None:
    file = scenario(tmp_path, '[sensors]\nquality = "ideal"\n[sensors.htx221]\nhumidity_bias_percent = 2.5\n')
    board = GreenhouseBoard(scenario=file)
    board.world.set_humidity(40)
    board.i2c1.write(HTX221_AT, b"\x20\x83")
    board.run_for(0.1)
    assert int.from_bytes(board.i2c1.write_read(HTX221_AT, b"\xa8", 2), "little") / 256 == 42.5


def test_editor_schema_describes_board() -> None:
    ours, labs = (json.dumps(json_schema(board)) for board in (GREENHOUSE, FCU001V1))
    assert '"enum": ["green"]' in ours
    assert '"enum": ["HTX221", "LPS22HB"]' in ours
    assert "lsm6dsl" not in ours
    assert '"enum": ["led1", "led2"]' in labs
    assert "htx221" not in labs


def test_neutral_scenario_runs_on_both_boards(tmp_path: Path) -> None:
    file = scenario(tmp_path, '[[timeline]]\ndo = "set_temperature"\ntemperature_degc = 30\n')
    for board in (Board(scenario=load_scenario(file)), GreenhouseBoard(scenario=file)):
        board.run_for(0.1)
        assert board.world.temperature_degc([0.05])[0] == 30


def test_board_state_is_restored_and_released() -> None:
    board = GreenhouseBoard(ideal=True)
    board.i2c1.write(HTX221_AT, b"\x20\x83")
    ready = board.snapshot()
    seen = []
    for percent in (20, 60, 20):
        board.restore(ready)
        board.world.set_humidity(percent)
        board.run_for(0.2)
        seen.append(board.i2c1.write_read(HTX221_AT, b"\xa8", 4))
    assert seen[0] == seen[2] != seen[1]

    watched = weakref.ref(board)
    del board, ready
    gc.collect()
    assert watched() is None


def test_inconsistent_board_description_is_refused() -> None:
    def described(**changes: Any) -> BoardDescription:
        given = {
            "name": "bench",
            "parts": (GREENHOUSE.parts[0],),
            "i2c": {"I2C1": I2cPins(("B", 6, 4), ("B", 7, 4))},
            "serial": SerialLine("USART2", ("A", 2, 7), 42_000_000),
            "timer": CallbackTimer("TIM10", 84_000_000, 3),
            "wirings": (Wiring("bench", "I2C1", {"HTX221": 0x5F}, "a bench"),),
        }
        return BoardDescription(**{**given, **changes})

    assert described().addresses == {"HTX221": 0x5F}
    for places, bus, says in (
        ({"HTX221": 0x5F}, "I2C3", "unknown bus I2C3; known: I2C1"),
        ({"HTS221": 0x5F}, "I2C1", "unknown part HTS221; known: HTX221"),
        ({"HTX221": "PA8"}, "I2C1", "HTX221 on I2C1 must be at a 7-bit address, not 'PA8'"),
    ):
        with pytest.raises(InputError, match=says):
            described(wirings=(Wiring("bench", bus, places, "a bench"),))
    with pytest.raises(InputError, match="LSM6DSL") as refused:
        MountedSensor(LSM6DSL)
    assert refused.value.kind == "no_mounting"
