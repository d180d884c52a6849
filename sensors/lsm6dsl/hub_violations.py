"""Settings of the sensor hub that cannot work (AN5040 section 7)."""

from __future__ import annotations

from sensors.lsm6dsl.hub_ironing import RAW_BYTES
from sensors.lsm6dsl.hub_slaves import OUTPUT_BYTES, Plan
from sensors.lsm6dsl.registers import CTRL9_XL, MASTER_CONFIG


def violations(mem: bytearray, plan: Plan, *, enabled: bool, active: bool) -> dict[str, bool]:
    """Every one, and whether it is present; ``active``: enabled, with a sensor that triggers."""
    control = mem[MASTER_CONFIG.addr]
    iron = bool(control & MASTER_CONFIG.IRON_EN.mask)
    soft = bool(mem[CTRL9_XL.addr] & CTRL9_XL.SOFT_EN.mask)
    passes = bool(control & MASTER_CONFIG.PASS_THROUGH_MODE.mask)
    longest = OUTPUT_BYTES - RAW_BYTES if iron else OUTPUT_BYTES
    return {
        "MASTER_CONFIG: MASTER_ON and PASS_THROUGH_MODE at once": enabled and passes,
        f"SLAVEx_CONFIG: more than {longest} bytes to read": active and plan.length > longest,
        "MASTER_CONFIG.IRON_EN needs slave 0 to read 6 bytes": active
        and iron
        and not plan.reads_magnetometer,
        "CTRL9_XL.SOFT_EN needs MASTER_CONFIG.IRON_EN": active and soft and not iron,
    }
