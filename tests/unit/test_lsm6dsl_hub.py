"""The LSM6DSL's sensor hub (datasheet DocID028475 Rev 7; application note AN5040 Rev 3, section 7).

Most tests follow the example in the application note: the hub sets up and reads a LIS2MDL on the auxiliary bus.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.sensors import LIS2MDL, LSM6DSL
from fcu_emulator.sensors.declaration import Bus
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from fcu_emulator.sensors.lsm6dsl.hub import UNANSWERED_PS, WRITE_PS, read_ps
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import (
    FACTS,
    PS_PER_MS,
    PS_PER_S,
    PS_PER_US,
    Chip,
    Writes,
    constant,
    decode,
    ramp,
    step,
)
from tests.support.words import Words

FUNC_CFG_ACCESS, CTRL1_XL, CTRL2_G, CTRL3_C, CTRL9_XL, CTRL10_C = 0x01, 0x10, 0x11, 0x12, 0x18, 0x19
MASTER_CONFIG, SENSORHUB1, SENSORHUB13 = 0x1A, 0x2E, 0x4D
FUNC_SRC1, FUNC_SRC2, TAP_CFG, MD2_CFG, OUT_MAG_RAW, X_OFS_USR = 0x53, 0x54, 0x58, 0x5F, 0x66, 0x73
END_OP, SI_END_OP, HI_FAIL = 0x01, 0x02, 0x04
MASTER_ON, IRON_EN, PASS_THROUGH, START_CONFIG = 0x01, 0x02, 0x04, 0x10
SLV0_ADD, SLV0_SUBADD, SLAVE0_CONFIG, SLV1_ADD, SLAVE1_CONFIG, DATAWRITE = 0x02, 0x03, 0x04, 0x05, 0x07, 0x0E
MAG_SI_XX, MAG_OFFX_L = 0x24, 0x2D
XL_104_HZ = 0x40
LIS2MDL_READ = ((SLV0_ADD, 0x3D), (SLV0_SUBADD, 0x68), (SLAVE0_CONFIG, 0x06))
CLOCK_PS = PS_PER_S / 116_300  # datasheet T8


class Recorder:
    """A device of 256 registers that records the times and addresses of accesses."""

    NAME: ClassVar[str] = "recorder"
    BUS: ClassVar[Bus] = Bus(i2c_addresses=(), spi_wires=None, source="this test")

    def __init__(self) -> None:
        self.i2c_off = False
        self.registers = bytearray(range(128))
        self.reads: list[tuple[int, int, int]] = []
        self.writes: list[tuple[int, int, int]] = []

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        self.reads.append((now_ps, address, count))
        return bytes(self.registers[address : address + count])

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.writes.append((now_ps, address, data[0]))
        self.registers[address] = data[0]

    def advance(self, address: int, count: int) -> int:
        return address + count

    def register_name(self, address: int) -> str:
        return f"register {address}"

    def accessible(self, now_ps: int) -> bool:
        return True

    def refuse(self, now_ps: int) -> None:
        raise AssertionError("it is accessible")


def hub(
    bank_a: Writes,
    *,
    xl: int = XL_104_HZ,
    master: int = MASTER_ON,
    errors: LSM6DSLErrors | None = None,
    **devices: Recorder,
) -> Chip:
    """Set up the hub as in AN5040 7.2: bank A in power-down, then FUNC_EN, MASTER_ON and the accelerometer.

    ``devices`` are attached at address ``a<hex>``.
    """
    chip = Chip("LSM6DSL", errors)
    for name, device in devices.items():
        lsm6dsl(chip).attach_auxiliary(int(name[1:], 16), device)
    start(chip, bank_a, xl, master)
    return chip


def start(chip: Chip, bank_a: Writes, xl: int = XL_104_HZ, master: int = MASTER_ON) -> None:
    chip.configure(((FUNC_CFG_ACCESS, 0x80), *bank_a, (FUNC_CFG_ACCESS, 0x00)))
    chip.configure(((CTRL10_C, 0x04), (MASTER_CONFIG, master), (CTRL1_XL, xl)))


def lsm6dsl(chip: Chip) -> LSM6DSL:
    assert isinstance(chip.part, LSM6DSL)
    return chip.part


def with_magnetometer(chip: Chip) -> LIS2MDL:
    magnetometer = FACTS["LIS2MDL"].build(chip.world, None, 0)
    assert isinstance(magnetometer, LIS2MDL)
    lsm6dsl(chip).attach_auxiliary(0x1E, magnetometer)
    return magnetometer


def outputs(chip: Chip) -> bytes:
    return chip.read(SENSORHUB1, 12) + chip.read(SENSORHUB13, 6)


def stop(chip: Chip) -> None:
    """Stop the hub as in AN5040 7.2: master off, sensors off. Then bank A can be written again."""
    chip.configure(((MASTER_CONFIG, 0x00), (CTRL1_XL, 0x00)))


# -- the note's example ---------------------------------------------------------------------------------


def test_hub_sets_up_and_reads_lis2mdl() -> None:
    """AN5040 7.2.4: slave 0 writes CFG_REG_A once, and END_OP shows the end. Then it reads OUTX_L to OUTZ_H."""
    chip = Chip("LSM6DSL")
    magnetometer = with_magnetometer(chip)
    start(
        chip,
        (
            (SLV0_ADD, 0x3C),
            (SLV0_SUBADD, 0x60),
            (DATAWRITE, 0x8C),
            (SLAVE0_CONFIG, 0x10),
            (SLAVE1_CONFIG, 0x20),
        ),
    )
    chip.wait(PS_PER_S // 10)
    assert chip.byte(FUNC_SRC1) & END_OP
    assert magnetometer.read(0x60, 1, chip.t_ps) == b"\x8c"

    stop(chip)
    start(chip, LIS2MDL_READ)
    chip.wait(PS_PER_S)

    assert decode(chip.read(SENSORHUB1, 6)) == (133, 0, -267)  # 200, 0, -400 mgauss at 1.5 mgauss/LSB
    assert chip.read(SENSORHUB1 + 6, 6) + chip.read(SENSORHUB13, 6) == bytes(12)
    assert chip.notes == []


def test_hub_outputs_keep_field_of_transfer_time() -> None:
    """A later read has no effect: the outputs are those of the latest round, 10 s ago."""
    chip = Chip("LSM6DSL")
    magnetometer = with_magnetometer(chip)
    chip.world.signals["magnetic_field_mgauss"] = ramp((0.0, 0.0, 0.0), (15.0, 0.0, 0.0))
    magnetometer.write(0x60, b"\x8c", 0)
    start(chip, LIS2MDL_READ)
    chip.wait(10 * PS_PER_S)
    chip.write(MASTER_CONFIG, 0x00)
    chip.wait(10 * PS_PER_S)

    assert abs(decode(chip.read(SENSORHUB1, 2))[0] - 100) <= 1


# -- timing ---------------------------------------------------------------------------------------------


def test_transfers_take_documented_time_on_bus() -> None:
    """Datasheet T8: 116.3 kHz. A byte takes nine clocks; start, repeated start and stop take one clock each."""
    assert pytest.approx(29 * CLOCK_PS, rel=1e-6) == WRITE_PS
    assert pytest.approx(11 * CLOCK_PS, rel=1e-6) == UNANSWERED_PS
    assert read_ps(6) == pytest.approx(84 * CLOCK_PS, rel=1e-6)

    device = Recorder()
    chip = hub(LIS2MDL_READ, a1E=device)
    chip.wait(2 * PS_PER_S)
    chip.byte(FUNC_SRC1)
    first, second = device.reads[0][0], device.reads[1][0]

    assert first == -(-PS_PER_S // 104) + read_ps(6)
    assert second - first == pytest.approx(PS_PER_S / 104, abs=1)
    assert {(address, count) for _, address, count in device.reads} == {(0x68, 6)}


@pytest.mark.parametrize(
    ("xl", "g", "per_s"),
    [
        (0x10, 0x00, 12),
        (0x20, 0x00, 26),
        (0x40, 0x00, 104),
        (0x50, 0x00, 104),
        (0x80, 0x00, 104),
        (0xA0, 0x00, 104),
        (0x00, 0x30, 52),  # the gyroscope alone
        (0x20, 0x60, 26),
        (0x00, 0x00, 0),
    ],
)
@pytest.mark.parametrize("percent", [0.0, 7.0])
def test_hub_trigger_rate_is_at_most_104_hz(xl: int, g: int, per_s: int, percent: float) -> None:
    """The sensor's own oscillator determines the rate."""
    device = Recorder()
    chip = hub(LIS2MDL_READ, xl=xl, errors=LSM6DSLErrors(odr_percent=percent), a1E=device)
    chip.write(CTRL2_G, g)
    chip.wait(10 * PS_PER_S)
    chip.byte(FUNC_SRC1)

    assert len(device.reads) == pytest.approx(10 * per_s * (1 + percent / 100), abs=6)


def test_end_op_is_0_during_transfers() -> None:
    """AN5040 7.2.3. Before MASTER_ON the flag has the datasheet's default, 0."""
    device = Recorder()
    chip = hub(LIS2MDL_READ, a1E=device, master=0)
    assert chip.byte(FUNC_SRC1) == 0

    chip.write(MASTER_CONFIG, MASTER_ON)
    trigger = -(-PS_PER_S // 104)
    seen = []
    for t_ps in (trigger - 1, trigger, trigger + read_ps(6) - 1, trigger + read_ps(6)):
        chip.t_ps = t_ps
        seen.append((chip.byte(FUNC_SRC1) & END_OP, chip.byte(SENSORHUB1)))

    assert seen == [(1, 0), (0, 0), (0, 0), (1, 0x68)]


def test_latched_end_op_is_cleared_by_reading() -> None:
    """AN5040 7.2.3: LIR = 1 and DRDY_ON_INT1."""
    chip = hub(LIS2MDL_READ, a1E=Recorder(), master=0)
    chip.configure(((TAP_CFG, 0x01), (MASTER_CONFIG, 0x80 | MASTER_ON)))
    assert chip.byte(FUNC_SRC1) == 0
    chip.wait(50 * PS_PER_MS)

    assert (chip.byte(FUNC_SRC1), chip.byte(FUNC_SRC1)) == (END_OP, 0)
    chip.wait(50 * PS_PER_MS)
    assert chip.byte(FUNC_SRC1) == END_OP


# -- slaves ---------------------------------------------------------------------------------------------


def slaves(*configs: tuple[int, int, int, int]) -> Writes:
    """Return (address byte, sub-address, length, rate code) of slaves 0, 1 ..."""
    writes: list[tuple[int, int]] = []
    for number, (address, subaddress, length, rate) in enumerate(configs):
        base = SLV0_ADD + 3 * number
        extra = (len(configs) - 1) << 4 if number == 0 else 0
        writes += [(base, address), (base + 1, subaddress), (base + 2, rate << 6 | extra | length)]
    return tuple(writes)


def test_outputs_of_slaves_are_packed_without_gaps() -> None:
    """AN5040 7.2: SENSORHUB1 to 12, then 13 to 18, in the order of the slaves."""
    device, other = Recorder(), Recorder()
    chip = hub(
        slaves((0x3D, 0x10, 7, 0), (0x41, 0x20, 2, 0), (0x3D, 0x30, 6, 0), (0x41, 0x40, 3, 0)),
        a1E=device,
        a20=other,
    )
    chip.wait(PS_PER_S)

    expected = [*range(0x10, 0x17), 0x20, 0x21, *range(0x30, 0x36), 0x40, 0x41, 0x42]
    assert list(outputs(chip)) == expected
    assert chip.notes == []


def test_more_than_18_bytes_are_cut_and_noted(words: Words) -> None:
    chip = hub(slaves((0x3D, 0x10, 7, 0), (0x3D, 0x20, 7, 0), (0x3D, 0x30, 7, 0)), a1E=Recorder())
    chip.wait(PS_PER_S)

    assert list(outputs(chip)) == [*range(0x10, 0x17), *range(0x20, 0x27), *range(0x30, 0x34)]
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))


def test_cut_bytes_change_no_other_register() -> None:
    """The bytes of slave 2 are partly beyond SENSORHUB18, the bytes of slave 3 completely."""
    chip = hub(slaves(*((0x3D, 0x10 * n, 7, 0) for n in range(1, 5))), a1E=Recorder())
    chip.write(X_OFS_USR, 0x41, 0x42, 0x43)
    chip.wait(PS_PER_S)

    assert outputs(chip)[-4:] == bytes(range(0x30, 0x34))
    assert chip.read(X_OFS_USR, 3) == b"\x41\x42\x43"


def test_slave_without_read_uses_no_output_bytes() -> None:
    """The slave has r_1 = 0, and slave 0 writes."""
    chip = hub(slaves((0x3C, 0x05, 0, 0), (0x3C, 0x20, 3, 0), (0x3D, 0x30, 2, 0)), a1E=Recorder())
    chip.wait(PS_PER_S)

    assert outputs(chip) == b"\x30\x31" + bytes(16)


def test_slave_rate_divides_triggers_by_1_to_8() -> None:
    device = Recorder()
    chip = hub(slaves(*((0x3D, 0x10 * (code + 1), 1, code) for code in range(4))), a1E=device)
    chip.t_ps = -(-16 * PS_PER_S // 104) + 9 * PS_PER_MS
    chip.byte(FUNC_SRC1)
    turns = [address for _, address, _ in device.reads]

    assert [turns.count(0x10 * (code + 1)) for code in range(4)] == [16, 8, 4, 2]
    assert turns[:4] == [0x10, 0x20, 0x30, 0x40], "all at the first trigger, in their order"


@pytest.mark.parametrize(
    ("extra", "once", "writes"),
    [(1, True, 1), (1, False, 10), (0, True, 10)],  # write_once needs more than one slave
)
def test_write_once_needs_more_than_one_slave(extra: int, once: bool, writes: int) -> None:
    """Datasheet 11.8."""
    device = Recorder()
    bank_a = (
        (SLV0_ADD, 0x3C),
        (SLV0_SUBADD, 0x05),
        (SLAVE0_CONFIG, extra << 4),
        (SLAVE1_CONFIG, 0x20 if once else 0x00),
        (DATAWRITE, 0xAB),
    )
    chip = hub(bank_a, a1E=device)
    chip.t_ps = -(-10 * PS_PER_S // 104) + 5 * PS_PER_MS
    chip.byte(FUNC_SRC1)

    assert [(address, value) for _, address, value in device.writes] == [(0x05, 0xAB)] * writes
    assert outputs(chip) == bytes(18)


@pytest.mark.parametrize(("status", "reads"), [(0, 0), (1, 1)])
def test_src_mode_reads_only_if_tested_register_nonzero(status: int, reads: int) -> None:
    """AN5040 7.2: Slave_dataw names the register."""
    device = Recorder()
    device.registers[0x27] = status
    chip = hub(((SLV0_ADD, 0x3D), (SLV0_SUBADD, 0x10), (DATAWRITE, 0x27), (SLAVE0_CONFIG, 0x0E)), a1E=device)
    chip.t_ps = 15 * PS_PER_MS
    chip.byte(FUNC_SRC1)

    assert [entry[1:] for entry in device.reads] == [(0x27, 1), (0x10, 6)][: 1 + reads]
    assert device.reads[-1][0] == -(-PS_PER_S // 104) + read_ps(1) + reads * read_ps(6)


def test_silent_slaves_are_reported_and_keep_their_bytes() -> None:
    """Datasheet 9.68: FUNC_SRC2 bits 3 to 6. The flag shows the latest round."""
    device = Recorder()
    chip = hub(
        slaves((0x3D, 0x10, 1, 0), (0x51, 0x20, 1, 0), (0x3D, 0x30, 1, 0), (0x53, 0, 1, 0)), a1E=device
    )
    chip.wait(PS_PER_S)
    assert (chip.byte(FUNC_SRC2), outputs(chip)[:4]) == (0x50, b"\x10\x00\x30\x00")

    device.i2c_off = True
    device.registers[0x10] = 0xFF
    chip.wait(PS_PER_S)
    assert (chip.byte(FUNC_SRC2), outputs(chip)[:4]) == (0x78, b"\x10\x00\x30\x00")

    device.i2c_off = False
    chip.wait(PS_PER_S)
    assert (chip.byte(FUNC_SRC2), outputs(chip)[:4]) == (0x50, b"\xff\x00\x30\x00")


# -- on and off -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "off",
    [(CTRL10_C, 0x00), (MASTER_CONFIG, 0x00), (CTRL1_XL, 0x00), (CTRL3_C, 0x05)],
)
@pytest.mark.parametrize("in_a_round", [False, True])
def test_switching_off_stops_hub(off: tuple[int, int], in_a_round: bool) -> None:
    device = Recorder()
    chip = hub(LIS2MDL_READ, a1E=device)
    chip.t_ps = -(-104 * PS_PER_S // 104) + (PS_PER_US if in_a_round else 5 * PS_PER_MS)
    chip.byte(FUNC_SRC1)
    reads = len(device.reads)
    chip.write(*off)
    chip.wait(PS_PER_S)

    assert reads == (103 if in_a_round else 104)
    assert chip.byte(FUNC_SRC1) == (END_OP if off[0] == CTRL1_XL else 0)
    assert len(device.reads) == reads
    assert any(outputs(chip)) is (off[0] != CTRL3_C)


def test_pass_through_connects_buses_and_excludes_master(words: Words) -> None:
    """AN5040 7.3."""
    device = Recorder()
    chip = hub(LIS2MDL_READ, master=PASS_THROUGH, a1E=device)
    assert lsm6dsl(chip).pass_through
    assert chip.notes == []

    chip.write(MASTER_CONFIG, PASS_THROUGH | MASTER_ON)
    chip.wait(PS_PER_S)
    chip.byte(FUNC_SRC1)
    assert device.reads == []
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    chip.write(MASTER_CONFIG, MASTER_ON)
    assert not lsm6dsl(chip).pass_through


def by_pin(high: bool = False) -> tuple[Chip, Recorder]:
    """Return a hub that INT2 triggers (START_CONFIG)."""
    device = Recorder()
    chip = Chip("LSM6DSL")
    lsm6dsl(chip).attach_auxiliary(0x1E, device)
    if high:
        chip.write(MASTER_CONFIG, MASTER_ON | START_CONFIG)
        lsm6dsl(chip).int2.apply(1, chip.t_ps)
        chip.write(MASTER_CONFIG, 0x00)
    start(chip, LIS2MDL_READ, master=MASTER_ON | START_CONFIG)
    return chip, device


def test_rise_of_int2_triggers_round_of_hub() -> None:
    """With START_CONFIG = 1, INT2 is an input."""
    chip, device = by_pin()
    pin = lsm6dsl(chip).int2
    assert pin.level is None
    chip.wait(PS_PER_S)
    pin.apply(1, chip.t_ps)
    rose_ps = chip.t_ps
    chip.wait(PS_PER_S)
    pin.apply(0, chip.t_ps)
    chip.wait(PS_PER_S)
    chip.byte(FUNC_SRC1)

    assert [at_ps for at_ps, _, _ in device.reads] == [rose_ps + read_ps(6)]
    assert chip.read(SENSORHUB1, 6) == bytes(range(0x68, 0x6E))
    assert chip.notes == []


def test_rise_of_int2_during_round_is_ignored() -> None:
    chip, device = by_pin()
    for level in (1, 0, 1, 0):
        lsm6dsl(chip).int2.apply(level, chip.t_ps)
        chip.wait(read_ps(6) // 4)
    chip.wait(PS_PER_S)
    chip.byte(FUNC_SRC1)

    assert len(device.reads) == 1


def test_high_int2_triggers_when_hub_is_enabled() -> None:
    chip, device = by_pin(high=True)
    chip.wait(PS_PER_S)
    chip.byte(FUNC_SRC1)

    assert [at_ps for at_ps, _, _ in device.reads] == [read_ps(6)]


@pytest.mark.parametrize("address", [-1, 0x80])
def test_auxiliary_address_has_seven_bits(address: int) -> None:
    with pytest.raises(ValueError, match="0x7F"):
        lsm6dsl(Chip("LSM6DSL")).attach_auxiliary(address, Recorder())


def test_second_device_at_auxiliary_address_is_refused() -> None:
    part = lsm6dsl(Chip("LSM6DSL"))
    part.attach_auxiliary(0x1E, Recorder())
    with pytest.raises(ValueError, match="0x1E"):
        part.attach_auxiliary(0x1E, Recorder())


# -- ironing --------------------------------------------------------------------------------------------


def ironing(chip: Chip, soft: Iterable[int], hard: tuple[int, int, int], *, soft_on: bool = True) -> None:
    """Set up AN5040 7.5.4: a LIS2MDL as slave 0, matrix and offsets in bank A, SOFT_EN, then IRON_EN."""
    offsets = np.array(hard, dtype="<i2").tobytes()
    matrix = tuple((MAG_SI_XX + place, value) for place, value in enumerate(soft))
    bank_a = LIS2MDL_READ + matrix + tuple((MAG_OFFX_L + place, value) for place, value in enumerate(offsets))
    chip.write(CTRL9_XL, 0x04 if soft_on else 0x00)
    start(chip, bank_a, master=MASTER_ON | IRON_EN)


def measuring(*mgauss: float) -> Chip:
    chip = Chip("LSM6DSL")
    with_magnetometer(chip).write(0x60, b"\x8c", 0)
    chip.world.signals["magnetic_field_mgauss"] = constant(*mgauss)
    return chip


UNIT = (8, 0, 0, 0, 8, 0, 0, 0, 8)


@pytest.mark.parametrize(
    ("soft", "soft_on", "calibrated"),
    [
        (UNIT, True, (90, 220, -330)),
        # Sign and magnitude, 1/8 per LSB: 2, -0.5; 0.125, 1; -1, 0, 1.5.
        ((16, 0x84, 0, 1, 8, 0, 0x88, 0, 12), True, (180 - 110, 11 + 220, -90 - 495)),
        ((16, 0x84, 0, 1, 8, 0, 0x88, 0, 12), False, (90, 220, -330)),
    ],
)
def test_iron_correction_gives_documented_outputs(
    soft: tuple[int, ...], soft_on: bool, calibrated: tuple[int, int, int]
) -> None:
    """AN5040 7.5.3: raw M, calibrated SI (M - HI), uncalibrated SI (M - HI) + HI."""
    raw, hard = (100, 200, -300), (10, -20, 30)
    chip = measuring(*(1.5 * value for value in raw))
    ironing(chip, soft, hard, soft_on=soft_on)
    chip.wait(PS_PER_S // 2)
    uncalibrated = tuple(value + offset for value, offset in zip(calibrated, hard, strict=True))

    assert decode(chip.read(OUT_MAG_RAW, 6)) == raw
    for found, expected in ((SENSORHUB1, calibrated), (SENSORHUB13, uncalibrated)):
        for one, other in zip(decode(chip.read(found, 6)), expected, strict=True):
            assert one == pytest.approx(other, abs=0.5), "rounded to whole LSB"
    assert not chip.byte(FUNC_SRC1) & HI_FAIL


def test_correction_end_pulse_lasts_10_ms() -> None:
    """AN5040 7.5.3, LIR = 0. The rate is 12.5 Hz, because at 104 Hz the next round would come before the end."""
    chip = measuring(15.0, 0.0, 0.0)
    ironing(chip, UNIT, (0, 0, 0))
    chip.configure(((CTRL1_XL, 0x00), (CTRL1_XL, 0x10)))
    end = 80 * PS_PER_MS + read_ps(6)
    seen = []
    for t_ps in (end - 1, end, end + 10 * PS_PER_MS - 1, end + 10 * PS_PER_MS):
        chip.t_ps = t_ps
        seen.append(chip.byte(FUNC_SRC1))

    assert seen == [0, END_OP | SI_END_OP, END_OP | SI_END_OP, 0]


def test_si_end_op_latches_on_int2() -> None:
    chip = measuring(15.0, 0.0, 0.0)
    chip.configure(((TAP_CFG, 0x01), (MD2_CFG, 0x01)))
    ironing(chip, UNIT, (0, 0, 0))
    chip.wait(PS_PER_S)
    chip.write(MASTER_CONFIG, MASTER_ON)
    chip.wait(PS_PER_S)

    assert chip.byte(FUNC_SRC1) & SI_END_OP
    assert not chip.byte(FUNC_SRC1) & SI_END_OP


def test_correction_result_out_of_range_sets_hi_fail() -> None:
    chip = measuring(0.0, 0.0, 0.0)
    strong, weak = constant(30_000.0, 0.0, 0.0), constant(15.0, 0.0, 0.0)
    chip.world.signals["magnetic_field_mgauss"] = step(strong, weak, at_s=1.5)
    ironing(chip, (0x7F, 0, 0, 0, 8, 0, 0, 0, 8), (0, 0, 0))
    chip.wait(PS_PER_S)

    assert chip.byte(FUNC_SRC1) & HI_FAIL
    assert decode(chip.read(SENSORHUB1, 6)) == (32767, 0, 0)

    chip.wait(PS_PER_S)
    assert not chip.byte(FUNC_SRC1) & HI_FAIL


@pytest.mark.parametrize(
    ("writes", "master"),
    [(((SLAVE0_CONFIG, 5),), IRON_EN), ((), 0), (slaves((0x3D, 16, 6, 0), (0x3D, 32, 7, 0)), IRON_EN)],
)
def test_impossible_correction_is_noted(writes: Writes, master: int, words: Words) -> None:
    chip = Chip("LSM6DSL")
    lsm6dsl(chip).attach_auxiliary(0x1E, Recorder())
    chip.write(CTRL9_XL, 0x04)
    start(chip, (*LIS2MDL_READ, *writes), master=MASTER_ON | master)
    chip.wait(PS_PER_S)
    chip.write(TAP_CFG, 0x01)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))


# -- laziness -------------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(moments=st.lists(st.integers(0, PS_PER_S), max_size=15))
def test_hub_does_not_depend_on_reads(moments: list[int]) -> None:
    """The outputs, the flags and the traffic on the auxiliary bus are compared."""
    chips, devices = [], []
    for _ in range(2):
        device = Recorder()
        chip = Chip("LSM6DSL")
        chip.world.signals["magnetic_field_mgauss"] = ramp((0.0, 0.0, 0.0), (150.0, 75.0, -75.0))
        with_magnetometer(chip).write(0x60, b"\x8c", 0)
        lsm6dsl(chip).attach_auxiliary(0x20, device)
        start(chip, slaves((0x3D, 0x68, 6, 0), (0x41, 0x10, 3, 1), (0x43, 0x10, 1, 2)), 0x60)
        chips.append(chip)
        devices.append(device)
    often, once = chips
    for t_ps in sorted(moments):
        often.t_ps = t_ps
        often.read(SENSORHUB1, 6)
        often.read(FUNC_SRC1, 2)
        often.part.catch_up(t_ps)
    often.t_ps = once.t_ps = PS_PER_S

    assert outputs(often) == outputs(once)
    assert often.read(FUNC_SRC1, 2) == once.read(FUNC_SRC1, 2)
    assert devices[0].reads == devices[1].reads
