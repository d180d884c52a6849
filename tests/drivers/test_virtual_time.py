"""A driver module's waits and clocks on the board's time."""

from __future__ import annotations

import sys
import time
from types import ModuleType

import pytest

from fcu_emulator import Board, InputError
from fcu_emulator.emulator.adapters import virtual_time

CLOCKS = ["monotonic", "perf_counter", "time"]


def module(name: str, source: str) -> ModuleType:
    made = ModuleType(name)
    exec(source, vars(made))
    return made


@pytest.fixture
def driver(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    made = module("some_driver", "import time\nfrom time import sleep as pause, monotonic as now\nLIMIT = 3")
    monkeypatch.setitem(sys.modules, "some_driver", made)
    return made


def test_sleep_under_every_name_advances_virtual_time(driver: ModuleType) -> None:
    board = Board()
    with virtual_time(board, driver):
        driver.time.sleep(3600)
        driver.pause(0.5)
        driver.pause(0)
        assert driver.now() == board.now_s == 3600.5


@pytest.mark.parametrize("clock", CLOCKS)
def test_every_clock_counts_from_power_on(driver: ModuleType, clock: str) -> None:
    board = Board()
    board.run_until_ps(1_234_567_890_123)
    with virtual_time(board, driver):
        assert getattr(driver.time, clock)() == 1.234567890123
        assert getattr(driver.time, f"{clock}_ns")() == 1_234_567_890


def test_other_module_attributes_are_not_replaced(driver: ModuleType) -> None:
    with virtual_time(Board(), driver):
        assert driver.LIMIT == 3
        assert driver.time.gmtime(0).tm_year == 1970


def test_negative_wait_raises_value_error(driver: ModuleType) -> None:
    with virtual_time(Board(), driver), pytest.raises(ValueError, match="non-negative"):
        driver.pause(-0.1)


def test_real_time_returns_after_error(driver: ModuleType) -> None:
    def fail() -> None:
        with virtual_time(Board(), driver):
            assert driver.time is not time
            raise ZeroDivisionError

    for _ in range(2):  # and the driver is free for the next block
        with pytest.raises(ZeroDivisionError):
            fail()
        assert (driver.time, driver.pause, driver.now) == (time, time.sleep, time.monotonic)


def test_only_given_modules_and_submodules_are_changed(
    driver: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    inner = module("some_driver.bus", "from time import sleep")
    other = module("some_driver_2", "from time import sleep")
    monkeypatch.setitem(sys.modules, "some_driver.bus", inner)
    monkeypatch.setitem(sys.modules, "some_driver_2", other)
    real = time.sleep
    with virtual_time(Board(), driver, inner):
        assert inner.sleep is not real
        assert other.sleep is real
        assert time.sleep is real
    assert inner.sleep is real


def test_module_cannot_use_time_of_two_boards(driver: ModuleType) -> None:
    first, second = Board(), Board()
    with virtual_time(first, driver):
        with pytest.raises(InputError, match="some_driver") as refused:
            virtual_time(second, driver).__enter__()
        assert refused.value.kind == "time_in_use"
        driver.pause(1)
    with virtual_time(second, driver):
        driver.pause(2)
    assert (first.now_s, second.now_s) == (1, 2)


def test_firmware_runs_while_driver_waits(driver: ModuleType) -> None:
    board = Board(firmware="lab3")
    with virtual_time(board, driver):
        driver.pause(2.5)
    assert "Pitch:" in board.terminal.text
