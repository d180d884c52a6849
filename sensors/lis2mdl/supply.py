"""What the LIS2MDL draws, for estimates of battery life (datasheet and AN5069; sensor facts 2.2)."""

from __future__ import annotations

from sensors.lis2mdl.registers import CFG_REG_A, CFG_REG_B

_IDLE_UA = 1.5
_CONTINUOUS_UA = {  # by (low power, offset cancellation): at 10, 20, 50 and 100 Hz
    (False, False): (100.0, 200.0, 475.0, 950.0),
    (False, True): (120.0, 235.0, 575.0, 1130.0),
    (True, False): (25.0, 50.0, 125.0, 250.0),
    (True, True): (50.0, 100.0, 235.0, 460.0),
}


def supply_current_ua(mem: bytearray, single_hz: float) -> float:
    """Average supply current in microampere as the registers configure the part.

    ``single_hz``: how often firmware triggers a single measurement, where it does not measure continuously.
    The documents scale the current at 10 Hz for that, and so is it done above 10 Hz too.
    """
    config = mem[CFG_REG_A.addr]
    mode = bool(config & CFG_REG_A.LP.mask), bool(mem[CFG_REG_B.addr] & CFG_REG_B.OFF_CANC.mask)
    at_rate = _CONTINUOUS_UA[mode]
    if not config & CFG_REG_A.MD.mask:
        return at_rate[CFG_REG_A.ODR.get(config)]
    return (at_rate[0] - _IDLE_UA) * single_hz / 10 + _IDLE_UA
