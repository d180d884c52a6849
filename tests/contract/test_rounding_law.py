"""With every ROUNDING of the LSM6DSL, a burst equals the same bytes read one at a time.

The patterns of AN5040 Rev 3, 4.7, are written here a second time, and not taken from ``sensors``.
"""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.sensor_fakes import PS_PER_MS, Chip, ramp

CTRL1_XL, CTRL2_G, CTRL3_C, CTRL5_C, CTRL7_G = 0x10, 0x11, 0x12, 0x14, 0x16
PATTERNS = (
    {},
    {0x2D: 0x28},
    {0x27: 0x22},
    {0x2D: 0x22},
    {0x33: 0x2E},
    {0x33: 0x28},
    {0x39: 0x22},
    {0x33: 0x22},
)
STATUS_PATTERN = {0x1E: 0x53, 0x53: 0x1B}
TIMES = st.integers(0, 60 * PS_PER_MS)


def measuring(rounding: int, status: bool, bdu: bool) -> Chip:
    chip = Chip("LSM6DSL")
    chip.world.signals["acceleration_g"] = ramp((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
    chip.world.signals["angular_rate_dps"] = ramp((1.0, 2.0, 3.0), (10.0, 20.0, 30.0))
    chip.configure(
        (
            (CTRL3_C, 0x04 | bdu << 6),
            (CTRL1_XL, 0x40),
            (CTRL2_G, 0x40),
            (CTRL5_C, rounding << 5),
            (CTRL7_G, status << 2),
        )
    )
    return chip


@pytest.mark.parametrize("rounding", range(8))
@given(
    status=st.booleans(),
    bdu=st.booleans(),
    earlier=st.lists(st.tuples(st.integers(0x1B, 0x39), TIMES), max_size=3),
    start=st.one_of(st.integers(0x1B, 0x39), st.integers(0, 0x7F)),
    count=st.integers(1, 80),
    wait_ps=TIMES,
)
def test_burst_equals_single_byte_reads(
    rounding: int,
    status: bool,
    bdu: bool,
    earlier: list[tuple[int, int]],
    start: int,
    count: int,
    wait_ps: int,
) -> None:
    jumps = {0x3F: 0x3E, 0x7F: 0x00, **PATTERNS[rounding], **(STATUS_PATTERN if status else {})}
    burst, bytewise = (measuring(rounding, status, bdu) for _ in range(2))
    for chip in (burst, bytewise):
        for address, ps in earlier:
            chip.wait(ps)
            chip.read(address)
        chip.wait(wait_ps)

    one_by_one, address = bytearray(), start
    for _ in range(count):
        one_by_one += bytewise.read(address)
        address = jumps.get(address, address + 1)

    assert burst.read(start, count) == one_by_one
    assert burst.part.advance(start, count) == address
    assert [burst.read(a) for a in range(0x80)] == [bytewise.read(a) for a in range(0x80)]
