"""The running firmware: blocks of output, LEDs, settings, failed reads."""

from __future__ import annotations

from typing import Any

import pytest

from fcu_emulator.firmware_model import Lab3, Settings, Template
from tests.support.firmware_fakes import LED1, LED2, LIS2MDL, LPS22HB, LSM6DSL, FakeHal, run_until_power_off

TEMPLATE_BLOCK = (  # the lab's text; values of the slides' terminal, MAG the nearest raw value can give
    b"*****\n\n\n"
    b"ACC[x,y,z] 44 mg 23 mg 1008 mg \n\r"
    b"GYR[x,y,z] 700 mdps -70 mdps -70 mdps \n\r"
    b"MAG[x,y,z] 12 mg 201 mg -378 mg \n\r"
    b"Pre: 977.400024 hPa \n\r"
    b"*****\n\n\n"
)
PLOT_BLOCK_FLAT = (
    b"*****\n\r\n\r"
    b"Pitch: 0.000000 deg Roll: 0.000000 deg Yaw: 0.000000 deg \n\r"
    b"Altitude: 0.000000 m \n\r"
    b"*****\n\r\n\r"
)
BOOT_TRANSMISSIONS = 7
MG_PER_LSB = 0.122


def slide_board(power_off_at: int = 2) -> FakeHal:
    hal = FakeHal(power_off_at)
    hal.set_slide_values()
    return hal


def running(firmware_class: type[Lab3] | type[Template] = Lab3, settings: Settings | None = None) -> FakeHal:
    """Return a firmware after its boot, for calls of ``tick()``."""
    hal = FakeHal(power_off_at=2)
    hal.set_pressure(4003431)
    hal.set_axes(LSM6DSL, 0x28, 0, 0, 8197)
    run_until_power_off(firmware_class, hal, settings)
    hal.pin_events.clear()
    return hal


def tilt(hal: FakeHal, x_mg: float, y_mg: float, z_mg: float) -> None:
    """Set the accelerometer by its output axes: raw.X = out.Y, raw.Y = -out.X."""
    hal.set_axes(LSM6DSL, 0x28, round(y_mg / MG_PER_LSB), round(-x_mg / MG_PER_LSB), round(z_mg / MG_PER_LSB))
    hal.tick()


@pytest.mark.parametrize("pressure_raw", [4003431, 4003471])
def test_template_prints_values_of_slides(pressure_raw: int) -> None:
    hal = slide_board()
    hal.set_pressure(pressure_raw)
    run_until_power_off(Template, hal)
    assert b"".join(hal.transmissions[BOOT_TRANSMISSIONS:]) == TEMPLATE_BLOCK


def test_pressures_outside_slides_range_are_printed_differently() -> None:
    for raw in (4003430, 4003472):
        hal = slide_board()
        hal.set_pressure(raw)
        run_until_power_off(Template, hal)
        assert b"977.400024" not in hal.text


def test_lab3_prints_template_block_then_plot_block() -> None:
    hal = FakeHal(power_off_at=2)
    hal.set_slide_values()
    hal.set_axes(LSM6DSL, 0x28, 0, 0, 8197)
    run_until_power_off(Lab3, hal)
    template = TEMPLATE_BLOCK.replace(b"44 mg 23 mg 1008 mg", b"0 mg 0 mg 1000 mg")
    calibrated = template.replace(
        b"12 mg 201 mg -378 mg", b"0 mg 0 mg 0 mg"
    )  # the first sample is its own centre
    assert b"".join(hal.transmissions[BOOT_TRANSMISSIONS:]) == calibrated + PLOT_BLOCK_FLAT


def test_each_line_is_one_transmit() -> None:
    hal = slide_board()
    run_until_power_off(Lab3, hal)
    assert all(line.endswith((b"\n", b"\r")) for line in hal.transmissions)
    assert len(hal.transmissions) == BOOT_TRANSMISSIONS + 6 + 4


def test_blocks_are_1_s_apart() -> None:
    hal = slide_board(power_off_at=4)
    run_until_power_off(Template, hal)
    assert hal.text.count(TEMPLATE_BLOCK) == 3
    assert hal.delays_ms == [1000] * 4


def test_altitude_follows_pressure() -> None:
    hal = running()
    hal.set_pressure(round(976.2 * 4096))  # 1.2 hPa less is some 10.6 m up at 21.5 degC
    hal.tick()
    firmware = hal.firmware
    assert firmware is not None
    hal.transmissions.clear()
    hal.power_off_at = 10
    firmware.loop()
    altitude = float(hal.text.split(b"Altitude: ")[1].split()[0])
    assert altitude == pytest.approx(10.6, abs=0.1)
    assert firmware.alt == pytest.approx(altitude, abs=1e-6)


def test_template_toggles_both_leds_each_second() -> None:
    hal = slide_board(power_off_at=4)
    run_until_power_off(Template, hal)
    toggles = [event for event in hal.pin_events if event[0] == "toggle"]
    assert toggles == [("toggle", LED1, 0), ("toggle", LED2, 0), ("toggle", LED1, 1), ("toggle", LED2, 1)]


def test_led1_follows_pitch_and_led2_roll() -> None:
    hal = running()
    tilt(hal, -1000, 0, 0)
    assert hal.pins == {LED1: 0, LED2: 1}
    tilt(hal, 0, -1000, 0)
    assert hal.pins == {LED1: 1, LED2: 0}
    tilt(hal, 0, 0, 1000)
    assert hal.pins == {LED1: 1, LED2: 1}


def test_axis_of_led1_can_be_set() -> None:
    hal = running(settings=Settings(led1_axis="roll"))
    tilt(hal, -1000, 0, 0)
    assert hal.pins == {LED1: 1, LED2: 0}


def test_led_is_dark_at_threshold_itself() -> None:
    hal = running(settings=Settings(led_threshold_deg=45))
    tilt(hal, -1000, 0, 1000)
    firmware = hal.firmware
    assert firmware is not None
    assert firmware.pitch == 45.0
    assert hal.pins == {LED1: 1, LED2: 1}
    tilt(hal, -1002, 0, 1000)
    assert hal.pins == {LED1: 0, LED2: 1}


def test_led_pin_is_written_on_changes_only() -> None:
    hal = running()
    for _ in range(10):
        tilt(hal, 1000, 0, 0)
    for _ in range(10):
        tilt(hal, 0, 0, 1000)
    assert hal.pin_events == [("write", LED1, 0), ("write", LED1, 1)]


def test_mu_setting_affects_roll() -> None:
    rolls = {}
    for mu in (0.01, 1.0):
        hal = running(settings=Settings(mu=mu))
        tilt(hal, 900, 300, 300)
        assert hal.firmware is not None
        rolls[mu] = hal.firmware.roll
    assert rolls[0.01] > rolls[1.0] > 0


def test_tick_reads_four_bursts_in_lab_order() -> None:
    hal = running()
    hal.transactions.clear()
    hal.tick()
    assert [(kind, device, register, len(data)) for kind, device, register, data in hal.transactions] == [
        ("R", LSM6DSL, 0x28, 6),
        ("R", LSM6DSL, 0x22, 6),
        ("R", LIS2MDL, 0x68, 6),
        ("R", LPS22HB, 0x28, 3),
    ]


@pytest.mark.parametrize(
    ("device", "kept"), [(LSM6DSL, {"ACC", "GYR"}), (LIS2MDL, {"MAG"}), (LPS22HB, {"Pre"})]
)
def test_failed_read_keeps_only_its_old_values(device: int, kept: set[str]) -> None:
    hal = slide_board()
    firmware = run_until_power_off(Template, hal)
    hal.silent.add(device)
    for axes_device, register in ((LSM6DSL, 0x28), (LSM6DSL, 0x22), (LIS2MDL, 0x68)):
        hal.set_axes(axes_device, register, 1000, 2000, 3000)
    hal.set_pressure(4100000)
    hal.tick()
    hal.transmissions.clear()
    hal.power_off_at = 10
    firmware.loop()
    values = hal.text.split(b"*****\n\n\n")[1].splitlines()
    old_values = TEMPLATE_BLOCK.split(b"*****\n\n\n")[1].splitlines()
    assert {
        old[:3].decode() for old, new in zip(old_values, values, strict=True) if old and old == new
    } == kept


@pytest.mark.parametrize(
    ("setting", "value", "right"),
    [
        ("mu", 0.0, "0.01 to 1"),
        ("mu", float("nan"), "0.01 to 1"),
        ("led1_axis", "x", "'pitch' or 'roll'"),
        ("led_threshold_deg", -1, "0 to 180"),
        ("banner", "FX", "'FH' or 'FW'"),
        ("timer_prescaler", 65536, "0 to 65535"),
        ("timer_period", -1, "0 to 65535"),
    ],
)
def test_wrong_setting_is_refused_with_valid_values(setting: str, value: Any, right: str) -> None:
    with pytest.raises(ValueError, match=f"{setting} .*{right}") as caught:
        Settings(**{setting: value})
    assert "\n" not in str(caught.value)
