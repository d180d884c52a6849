"""The board through its Python API: time, firmware, terminal, LEDs, determinism."""

from __future__ import annotations

import gc
import re
import weakref
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board, ExpectationError, FirmwareError, InputError
from fcu_emulator.emulator.buses.i2c import FaultKind, I2CFault
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.errors import ScenarioError
from fcu_emulator.emulator.python_cpu.hal import HAL_BUSY, HAL_ERROR, HAL_OK, HAL_TIMEOUT, VirtualHal
from fcu_emulator.emulator.trace import BusTransfer, Fault, GpioEdge, TickLate, TickLost
from tests.support.board_fakes import script, start_timer

BOOT = (  # the lab's text
    "STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n"
    "LSM6DSL MEMS Accelerometer initialized and enabled\n"
    "LSM6DSL MEMS Gyroscope initialized and enabled\n"
    "LIS2MDL Magnetometer initialized and enabled\n"
    "LPS22HB Pressure sensor initialized and enabled\n"
    "LPS22HB Temperature sensor initialized and enabled\n"
    "LAB3 Init...\n"
)
INT = r"-?\d+"
FLOAT = r"-?\d+\.\d{6}"
TEMPLATE_BLOCK = (
    r"\*\*\*\*\*\n\n\n"
    rf"ACC\[x,y,z\] {INT} mg {INT} mg {INT} mg \n\r"
    rf"GYR\[x,y,z\] {INT} mdps {INT} mdps {INT} mdps \n\r"
    rf"MAG\[x,y,z\] {INT} mg {INT} mg {INT} mg \n\r"
    rf"Pre: {FLOAT} hPa \n\r"
    r"\*\*\*\*\*\n\n\n"
)
PLOT_BLOCK = (
    r"\*\*\*\*\*\n\r\n\r"
    rf"Pitch: {FLOAT} deg Roll: {FLOAT} deg Yaw: {FLOAT} deg \n\r"
    rf"Altitude: {FLOAT} m \n\r"
    r"\*\*\*\*\*\n\r\n\r"
)


def test_lab3_terminal_text_equals_that_of_lab() -> None:
    board = Board(firmware="lab3")
    board.run_for(4.15)
    assert re.fullmatch(re.escape(BOOT) + f"({TEMPLATE_BLOCK}{PLOT_BLOCK}){{3}}", board.terminal.text)


def test_template_prints_its_block_and_toggles_leds() -> None:
    board = Board(firmware="template")
    board.run_for(4)
    assert re.fullmatch(re.escape(BOOT) + f"({TEMPLATE_BLOCK}){{3}}", board.terminal.text)
    toggles = [edge.pin for edge in board.trace.of(GpioEdge) if edge.t_ps > 1.5 * PS_PER_S]
    assert toggles[:4] == ["PB5", "PB4", "PB5", "PB4"]


def test_banner_and_sensor_lines_have_exact_times() -> None:
    """The banner has 39 bytes of 10 bits at 84 MHz / 729. The LPS22HB driver waits 1 s before the five lines."""
    board = Board(firmware="lab3")
    board.run_for(39 * 10 * 729 / 84e6 - 1e-6)
    assert board.terminal.text == BOOT[:38]
    board.run_for(2e-6)
    assert board.terminal.text == BOOT[:39]
    board.run_for(0.99)
    assert board.terminal.text == BOOT[:39]
    board.terminal.expect("LSM6DSL", timeout_s=0.05)


def test_callbacks_come_at_exactly_800_hz() -> None:
    ticks: list[int] = []
    board = Board(firmware=script(start_timer, lambda hal: ticks.append(hal.HAL_GetTick())))
    board.run_for(60)
    assert len(ticks) == 800 * 60 + 1  # EGR.UG has set the flag: the first interrupt comes at once (RM0368)
    assert board.tim9.ticks == len(ticks)
    assert (board.tim9.late, board.tim9.lost) == (0, 0)


def test_stock_timer_setting_gives_807_point_692_hz() -> None:
    """ST's firmware: PSC 51, ARR 1999."""
    board = Board(firmware=script(lambda hal: start_timer(hal, 51, 1999)))
    board.run_for(13)
    assert board.tim9.ticks == 1 + 13 * 84_000_000 // (52 * 2000)


def test_callback_preempts_delay_and_transmit() -> None:
    running: list[str] = []

    def main(hal: VirtualHal) -> None:
        start_timer(hal)
        running.append("transmit")
        hal.HAL_UART_Transmit(bytes(100), 1000)
        running.append("delay")
        hal.HAL_Delay(20)
        running.append("done")

    seen: dict[str, int] = {}

    def tick(_hal: VirtualHal) -> None:
        if running:
            seen[running[-1]] = seen.get(running[-1], 0) + 1

    board = Board(firmware=script(main, tick))
    board.run_for(0.035)
    assert seen["transmit"] >= 6  # 8.7 ms
    assert seen["delay"] >= 15


def test_print_in_callback_during_print_returns_busy() -> None:
    """ST's HAL: a second HAL_UART_Transmit returns HAL_BUSY and its text is lost."""
    results: set[int] = set()

    def main(hal: VirtualHal) -> None:
        start_timer(hal)
        hal.HAL_UART_Transmit(b"x" * 60, 1000)

    def tick(hal: VirtualHal) -> None:
        if hal.HAL_GetTick() < 5:
            results.add(hal.HAL_UART_Transmit(b"?", 10))

    board = Board(firmware=script(main, tick))
    board.run_for(0.02)
    assert HAL_BUSY in results
    assert board.terminal.text.count("x") == 60


def test_hal_delay_waits_for_ticks_of_1_ms() -> None:
    """HAL V1.6.0: the first, partial millisecond counts as a whole millisecond."""
    ends: list[int] = []

    def main(hal: VirtualHal) -> None:
        hal.HAL_UART_Transmit(b"1234", 10)  # 0.35 ms
        hal.HAL_Delay(5)
        ends.append(hal.HAL_GetTick())
        hal.HAL_Delay(1000)
        ends.append(hal.HAL_GetTick())

    board = Board(firmware=script(main))
    board.run_for(2)
    assert ends == [5, 1005]


def test_100_khz_bus_loses_ticks_and_starves_main() -> None:
    """Four bursts take 772.5 us at 400 kHz and 3.09 ms at 100 kHz, with a period of 1.25 ms.

    The first callback is caused by the flag of EGR.UG, before the counter runs. After it the main loop has one
    period.
    """
    board = Board(firmware="lab3")
    board.i2c2.bus.set_speed(100_000)
    board.run_for(3)
    assert board.terminal.text == BOOT + "*****\n\n\nACC[x,y,"
    assert board.tim9.lost > board.tim9.late > 300
    assert len(board.trace.of(TickLate)) == board.tim9.late
    assert sum(event.count for event in board.trace.of(TickLost)) == board.tim9.lost


def test_leds_follow_tilt() -> None:
    board = Board(firmware="lab3", ideal=True)
    assert not board.led1.on
    board.run_for(1.5)
    assert (board.led1.on, board.led2.on) == (False, False)
    board.world.set_attitude(roll_deg=0, pitch_deg=81, yaw_deg=0)
    board.run_for(0.1)
    assert (board.led1.on, board.led2.on) == (True, False)
    board.world.set_attitude(roll_deg=-81, pitch_deg=0, yaw_deg=0)
    board.run_for(0.1)
    assert (board.led1.on, board.led2.on) == (False, True)


def test_terminal_read_and_expect_return_printed_text() -> None:
    board = Board(firmware="lab3")
    found = board.terminal.expect(r"FH rev\.(\d\.\d)")
    assert found[1] == "1.0"
    board.terminal.expect(r"Init\.\.\.\n")
    assert board.terminal.read().decode() == BOOT
    assert board.terminal.read() == b""
    with pytest.raises(ExpectationError, match=r"'nothing like this' .* 0\.5 s "):
        board.terminal.expect("nothing like this", timeout_s=0.5)
    assert board.now_s == pytest.approx(1.54, abs=0.02)


def test_all_256_byte_values_pass_both_ways() -> None:
    def echo(hal: VirtualHal) -> None:
        while True:
            status, data = hal.HAL_UART_Receive(1, 100)
            if status == HAL_OK:
                hal.HAL_UART_Transmit(data, 10)

    board = Board(firmware=script(echo))
    for value in range(256):
        board.terminal.write(bytes([value]))
        board.run_for(0.0005)
    assert board.terminal.read() == bytes(range(256))


def test_unread_input_overruns_as_on_board() -> None:
    """The stock firmware never reads. The first byte stays in DR, and the other bytes are lost."""
    board = Board(firmware="lab3")
    board.terminal.write("hello")
    board.run_for(0.1)
    board.terminal.write("!")
    assert board.terminal.uart.rx_lost == 4
    assert all("overrun" in event.text for event in board.trace.of(Fault))


def test_receive_timeout_returns_received_bytes() -> None:
    results: list[tuple[int, bytes]] = []
    board = Board(firmware=script(lambda hal: results.append(hal.HAL_UART_Receive(4, 20))))
    board.terminal.write("ab")
    board.run_for(0.1)
    assert results == [(HAL_TIMEOUT, b"ab")]


def test_unfinished_transmit_returns_timeout() -> None:
    results: list[int] = []
    board = Board(firmware=script(lambda hal: results.append(hal.HAL_UART_Transmit(bytes(1000), 10))))
    board.run_for(1)
    assert results == [HAL_TIMEOUT]
    assert 110 <= len(board.terminal.text) <= 130


@pytest.mark.parametrize(
    ("kind", "status"),
    [("absent", HAL_ERROR), ("stuck", HAL_BUSY), ("bus_error", HAL_ERROR), ("nack", HAL_ERROR)],
)
def test_bus_fault_returns_hal_status(kind: FaultKind, status: int) -> None:
    results: list[int] = []
    board = Board(firmware=script(lambda hal: results.append(hal.HAL_I2C_Mem_Write(0xD6, 0x10, b"\xa8"))))
    board.i2c2.inject(I2CFault(kind, 0, 1, address=0x6B, byte_index=1))
    board.run_for(0.1)
    assert results == [status]


def test_silent_sensor_stops_boot_after_banner() -> None:
    """ST's firmware: initializeAllSensors loops without a message."""
    board = Board(firmware="lab3")
    board.i2c2.inject(I2CFault("absent", address=0x1E))
    board.run_for(5)
    assert board.terminal.text == BOOT[:39]
    assert board.tim9.ticks == 0


def test_firmware_error_is_raised_and_time_continues() -> None:
    def main(hal: VirtualHal) -> None:
        hal.HAL_Delay(100)
        raise ZeroDivisionError("no such gain")

    board = Board(firmware=script(main))
    with pytest.raises(FirmwareError, match=r"failed at 0\.100000 s: ZeroDivisionError: no such gain"):
        board.run_for(1)
    board.run_for(1)
    assert board.now_s == pytest.approx(1.1)


SLICED_PS = 2200 * PS_PER_MS


@pytest.fixture(scope="module")
def whole() -> Board:
    """Return the results of a run in one piece, with all transfers on the bus."""
    board = Board(firmware="lab3", seed=3)
    board.trace.record_all()
    board.run_until_ps(SLICED_PS)
    return board


@settings(max_examples=10)
@given(st.lists(st.floats(0.0001, 0.4), min_size=1, max_size=5))
def test_splitting_run_does_not_change_results(whole: Board, slices: list[float]) -> None:
    sliced = Board(firmware="lab3", seed=3)
    sliced.trace.record_all()
    for seconds in slices:
        sliced.run_for(seconds)
    sliced.run_until_ps(SLICED_PS)
    assert sliced.terminal.text == whole.terminal.text
    assert sliced.trace.of(BusTransfer) == whole.trace.of(BusTransfer)


def test_output_depends_on_seed() -> None:
    texts = []
    for seed in (1, 1, 2):
        board = Board(firmware="lab3", seed=seed)
        board.run_for(3)
        texts.append(board.terminal.text)
    assert texts[0] == texts[1] != texts[2]


def test_memory_of_thirty_boards_is_released() -> None:
    boards = [Board(firmware="lab3", seed=seed) for seed in range(30)]
    for _ in range(3):
        for board in boards:
            board.run_for(0.5)
    assert len({board.terminal.text for board in boards}) == 30
    references = [weakref.ref(board) for board in boards]
    del board, boards
    gc.collect()
    assert not any(reference() for reference in references)


def test_board_may_be_garbage_collected_while_another_runs() -> None:
    """The garbage collector may run at any time, also while another board's firmware executes."""
    dropped = [Board(firmware="lab3") for _ in range(3)]
    for board in dropped:
        board.run_for(0.3)

    def main(hal: VirtualHal) -> None:
        hal.HAL_Delay(10)
        dropped.clear()
        gc.collect()
        hal.HAL_Delay(10)
        hal.HAL_UART_Transmit(b"still here", 10)

    board = Board(firmware=script(main))
    board.run_for(0.015)
    assert board.now_s == pytest.approx(0.015)
    board.run_for(0.015)
    assert board.terminal.text == "still here"


def test_unknown_name_error_lists_known_names() -> None:
    with pytest.raises(InputError, match=r"'lab4'.*: lab3, template") as firmware:
        Board(firmware="lab4")
    with pytest.raises(InputError, match=r"'lab2'.*: lab3") as wiring:
        Board(wiring="lab2")
    assert (firmware.value.kind, wiring.value.kind) == ("unknown_firmware", "unknown_wiring")


def test_unusable_values_are_refused_with_error_kind() -> None:
    board = Board()
    for seconds in (-1, float("nan")):
        with pytest.raises(InputError, match=rf" {seconds} s") as refused:
            board.run_for(seconds)
        assert refused.value.kind == "duration"
    with pytest.raises(InputError) as refused:
        board.terminal.expect("(")
    assert refused.value.kind == "pattern"
    with pytest.raises(InputError) as refused:
        board.terminal.write("\u20ac")
    assert refused.value.kind == "not_latin_1"


def test_callback_on_busy_bus_returns_busy() -> None:
    """The HAL locks its handle. Main loop and interrupt use the bus without another lock."""
    results: set[int] = set()

    def main(hal: VirtualHal) -> None:
        start_timer(hal)
        for _ in range(100):
            assert hal.HAL_I2C_Mem_Read(0xD6, 0x28, 30)[0] == HAL_OK

    board = Board(firmware=script(main, lambda hal: results.add(hal.HAL_I2C_Mem_Read(0xD6, 0x22, 6)[0])))
    board.trace.record_all()
    board.run_for(0.1)
    assert results == {HAL_OK, HAL_BUSY}
    transfers = board.trace.of(BusTransfer)
    assert all(one.end_ps <= other.t_ps for one, other in pairwise(transfers))


def test_firmware_variables_are_reachable_by_their_c_names() -> None:
    board = Board(firmware="lab3", ideal=True)
    board.run_for(2)
    assert board.variable("acc").AXIS_Z == 1000
    assert board.variable("press") == pytest.approx(965.2, abs=0.2)
    with pytest.raises(KeyError):
        board.variable("nothing")
    with pytest.raises(KeyError):
        Board().variable("acc")


@pytest.mark.parametrize("crystal_hz", [3_999_999, 26_000_001, 8e6 + 0.5, "8MHz"])
def test_crystal_outside_datasheet_range_is_refused(crystal_hz: Any) -> None:
    with pytest.raises(InputError, match="crystal_hz must be"):
        Board(crystal_hz=crystal_hz)


@pytest.mark.parametrize(("argument", "crystal_hz"), [(None, 8_000_000), (25_000_000, 25_000_000)])
def test_crystal_argument_overrides_crystal_of_scenario(
    argument: int | None, crystal_hz: int, tmp_path: Path
) -> None:
    file = tmp_path / "crystal.toml"
    file.write_text('schema = 1\nquestion = "Which crystal?"\ncrystal = "8MHz"\n', encoding="utf-8")

    assert Board(scenario=file, crystal_hz=argument).signals.crystal_hz == crystal_hz


@pytest.mark.parametrize("crystal", ['"3.9MHz"', '"27MHz"', "8", '"8"'])
def test_invalid_crystal_of_scenario_is_refused(crystal: str, tmp_path: Path) -> None:
    file = tmp_path / "crystal.toml"
    file.write_text(f'schema = 1\nquestion = "Which crystal?"\ncrystal = {crystal}\n', encoding="utf-8")

    with pytest.raises(ScenarioError) as refused:
        Board(scenario=file)
    assert refused.value.key == "crystal"


def test_crystal_setting_of_board_reaches_chip() -> None:
    board = Board(firmware="tests/arm/broken/other_port.elf", crystal_hz=25_000_000, ideal=True)
    assert board.signals.crystal_hz == 25_000_000
