"""The firmware's PWM runs the board's motors: TIM4 on the chip, and vibration of the sensors in the world."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator import Board

TIM4, RCC_APB1ENR = 0x4000_0800, 0x4002_3840
SETTINGS = {
    0x28: 84,
    0x2C: 1999,
    0x18: 0x6868,
    0x1C: 0x6868,
    0x20: 0x1111,
    0x14: 1,
    0x00: 1,
}  # as ST's firmware
CCR1 = 0x34
SCENARIO = """schema = 1
question = "?"
duration = "1s"
firmware = "solution"
[sensors]
quality = "ideal"
[[timeline]]
do = "run_motors"
throttle = "firmware"
"""


def test_duty_of_tim4_sets_throttle_of_motors(tmp_path: Path) -> None:
    path = tmp_path / "pwm.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    board = Board(scenario=path)
    assert board.chip is not None
    board.run_until(0.2)
    assert board.motor_duties() == (0, 0, 0, 0)
    core = board.chip.core
    core.poke(RCC_APB1ENR, (0x1000_4004 | 1 << 22).to_bytes(4, "little"))
    for offset, value in SETTINGS.items():
        core.poke(TIM4 + offset, value.to_bytes(4, "little"))
    for number, compare in enumerate((1000, 500, 0, 2000)):
        core.poke(TIM4 + CCR1 + 4 * number, compare.to_bytes(4, "little"))
    board.run_until(0.3)
    assert board.motor_duties() == pytest.approx((0.5, 0.25, 0.0, 1.0))
    assert board.world.throttle == board.motor_duties()
    core.poke(TIM4, b"\0\0\0\0")  # the timer is stopped
    board.run_until(0.4)
    assert board.world.throttle == (0, 0, 0, 0)
