"""Air pressure over the room's floor.

Decision: P = P_floor (1 - L h / T)^(g M / (R L)) with T the air's own temperature, where the ISA puts 288.15
K. The air in a room at 25 degC is lighter than the ISA's at 15 degC: over a stairwell of 20 m its pressure
falls 3.4 % less. The lab's altitude formula takes the temperature likewise (brief, "Arithmetic"). The ISA
serves only to find what a barometer shows at the floor, where the formula's reference height is the sea.
Source: U.S. Standard Atmosphere 1976, equation 33a, table 2.
"""

from __future__ import annotations

from emulator.world.track import Array

SEA_LEVEL_HPA = 1013.25
SEA_LEVEL_K = 288.15
ZERO_CELSIUS_K = 273.15
LAPSE_K_M = 0.0065
EXPONENT = 9.80665 * 0.0289644 / (8.31432 * LAPSE_K_M)  # g M / (R L) = 5.25588; the lab rounds it to 5.257


def isa_pressure_hpa(altitude_m: float) -> float:
    """The standard atmosphere's pressure at ``altitude_m`` above the sea."""
    return float(SEA_LEVEL_HPA * (1.0 - LAPSE_K_M * altitude_m / SEA_LEVEL_K) ** EXPONENT)


def pressure_ratio(height_m: Array, temperature_degc: Array) -> Array:
    """Pressure at ``height_m`` above the floor over that at the floor, in air of this temperature; (N,)."""
    return (1.0 - LAPSE_K_M * height_m / (temperature_degc + ZERO_CELSIUS_K)) ** EXPONENT
