"""Independent programs as references for the world: attitude filters, a magnet, the Earth's field.

``python -m tests.support.reference_models`` prints the results of each program; if a program's package is not
installed, the program is named and omitted. The small packages are in the extra ``test``. magpylib is not, because it
needs plotly: ``pip install magpylib``. ``tests/unit/test_reference_models.py`` asserts the figures.
"""

from __future__ import annotations

import datetime as dt
import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fcu_emulator import Board
from fcu_emulator.emulator.world import earth_field
from fcu_emulator.emulator.world.magnetism import Magnet
from fcu_emulator.emulator.world.track import Array

LSM6DSL, LIS2MDL = 0x6B, 0x1E
RATE_HZ = 208.0
G = 9.80665
STILL_S, MOVED_S = 4.0, 14.0


# -- attitude from hand motion ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Moved:
    """Readings of the sensors of a board in a hand, (N, 3) each in board axes, and the truth.

    ``acc_g``, ``rate_dps``, ``mag_mgauss``; ``rotation`` (N, 3, 3) board to world; ``added_g``: acceleration of the
    hand's motion, without gravity.
    """

    acc_g: Array
    rate_dps: Array
    mag_mgauss: Array
    rotation: Array
    added_g: Array


def moved_by_hand(seed: int = 1) -> Moved:
    """Return the readings of a board without errors, at rest for a while and then waved about a wrist."""
    board = Board(ideal=True)
    world, bus = board.world, board.i2c2
    world.set_magnetic_field(21.5, 0, 43)
    world.take_in_hand((0, -0.1, 0), start_s=1.0)
    rng = np.random.default_rng(seed)
    start_s = STILL_S
    while start_s < STILL_S + MOVED_S - 1.0:
        roll, pitch, yaw = rng.uniform((-60, -50, -80), (60, 50, 80))
        start_s = world.rotate_to(roll, pitch, yaw, duration_s=rng.uniform(0.5, 1.0), start_s=start_s)
    for address, register, value in (
        (LSM6DSL, 0x12, 0x44),
        (LSM6DSL, 0x10, 0x88),  # 1666 Hz, so that samples are hardly late; 4 g
        (LSM6DSL, 0x11, 0x8C),  # likewise, 2000 dps
        (LIS2MDL, 0x60, 0x8C),
    ):
        bus.write(address, bytes([register, value]))
    times_s = np.arange(1, int((STILL_S + MOVED_S) * RATE_HZ)) / RATE_HZ
    rows = []
    for time_s in times_s:
        board.run_until(time_s)
        motion = np.frombuffer(bus.write_read(LSM6DSL, b"\x22", 12), "<i2")
        field = np.frombuffer(bus.write_read(LIS2MDL, b"\x68", 6), "<i2")
        rows.append(np.concatenate((motion, field)))
    counts = np.array(rows, dtype=np.float64).reshape(-1, 3, 3)
    rate, acc, mag = (_board_axes(counts[:, n]) * lsb for n, lsb in enumerate((0.07, 0.122e-3, 1.5)))
    rotation = world.rotation(times_s)
    added = world.specific_force_g(times_s) - rotation[:, 2]
    return Moved(acc, rate, mag, rotation, added)


def _board_axes(raw: Array) -> Array:
    """Convert as the lab's ReadSensorRawData does."""
    return np.stack((-raw[:, 1], raw[:, 0], raw[:, 2]), axis=1)


def tilt_error_deg(found: Array, true: Array) -> Array:
    """Return the angle between two "up" directions in board axes, (N,): pitch and roll together, without the yaw."""
    cosine = np.einsum("ni,ni->n", found[:, 2], true[:, 2])
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def by_imufusion(moved: Moved, acc_g: Array) -> Array:
    """Return the attitudes of the x-io filter, board to world, (N, 3, 3)."""
    import imufusion

    ahrs = imufusion.Ahrs()
    settings = imufusion.AhrsSettings()
    settings.convention = imufusion.CONVENTION_NWU
    settings.sample_rate = RATE_HZ
    ahrs.set_settings(settings)
    found = []
    for rate, acc, mag in zip(moved.rate_dps, acc_g, moved.mag_mgauss, strict=True):
        ahrs.update(rate, acc, mag)
        found.append(imufusion.quaternion_to_matrix(ahrs.get_quaternion()))
    return np.array(found)


def by_madgwick(moved: Moved, acc_g: Array) -> Array:
    """Return the attitudes of Madgwick's filter in the package ahrs, in the same form."""
    from ahrs import Quaternion
    from ahrs.filters import Madgwick

    madgwick = Madgwick(frequency=RATE_HZ, gain=0.1)
    attitude, found = np.array([1.0, 0.0, 0.0, 0.0]), []
    for rate, acc, mag in zip(np.radians(moved.rate_dps), acc_g, moved.mag_mgauss, strict=True):
        attitude = madgwick.updateMARG(attitude, gyr=rate, acc=acc, mag=mag)
        found.append(Quaternion(attitude).to_DCM())
    return np.array(found)


def by_accelerometer(moved: Moved, acc_g: Array) -> Array:
    """Return the up direction of the lab's formulas, as the third row of an attitude."""
    found = np.zeros_like(moved.rotation)
    length = np.linalg.norm(acc_g, axis=1)
    found[:, 2] = acc_g / np.where(length == 0.0, 1.0, length)[:, np.newaxis]  # 0 until the first sample
    return found


FILTERS: dict[str, tuple[str, Callable[[Moved, Array], Array]]] = {
    "accelerometer alone": ("numpy", by_accelerometer),
    "imufusion": ("imufusion", by_imufusion),
    "ahrs, Madgwick": ("ahrs", by_madgwick),
}


def attitude_errors(moved: Moved, name: str) -> tuple[float, float, float]:
    """Return the RMS of the tilt's error in deg: at rest, in motion, and in motion without its acceleration."""
    still = slice(int(2.5 * RATE_HZ), int(STILL_S * RATE_HZ))
    waved = slice(int(STILL_S * RATE_HZ), None)
    find = FILTERS[name][1]
    felt = tilt_error_deg(find(moved, moved.acc_g), moved.rotation)
    gravity = tilt_error_deg(find(moved, moved.acc_g - moved.added_g), moved.rotation)
    return _rms(felt[still]), _rms(felt[waved]), _rms(gravity[waved])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


# -- a magnet -----------------------------------------------------------------------------------------------


def magnet_difference_mgauss() -> tuple[float, float]:
    """Compare a passing magnet's field with magpylib's dipole: return largest difference, and largest field."""
    import magpylib

    magnet = Magnet.starting_at(0.0, 8.0, 0.4, 0.5)
    t_s = np.linspace(0.0, 2.0 * magnet.closest_s, 501)
    ours = magnet.value(t_s)
    north_m = magnet.speed_m_s * (t_s - magnet.closest_s)
    # NWU: the magnet is east of the board, at -Y, and points west, to +Y
    dipole = magpylib.misc.Dipole(moment=(0.0, 8.0, 0.0))
    at_board = np.stack((-north_m, np.full(len(t_s), 0.4), np.zeros(len(t_s))), axis=1)
    theirs = np.asarray(dipole.getB(at_board)) * 1e7  # T to mgauss
    return float(np.abs(ours - theirs).max()), float(np.abs(ours).max())


# -- the Earth's field --------------------------------------------------------------------------------------


PLACES = [
    (latitude, longitude, altitude_m, day)
    for latitude, longitude, altitude_m in (
        (47.4, 8.5, 408.0),
        (0.0, -75.0, 0.0),
        (-33.9, 151.2, 50.0),
        (64.1, -21.9, 0.0),
        (-77.8, 166.7, 100.0),
        (35.7, 139.7, 9000.0),
        (65.0, 100.0, 0.0),
    )
    for day in (dt.date(2025, 1, 1), dt.date(2026, 6, 1), dt.date(2029, 11, 30))
]


def field_difference_nt() -> tuple[float, float]:
    """Compare the default field of places with NCEI's WMM program: return largest difference, and largest field."""
    from wmm import wmm_calc

    differences, fields = [], []
    for latitude, longitude, altitude_m, day in PLACES:
        model = wmm_calc()
        model.setup_time(day.year, day.month, day.day)
        model.setup_env(latitude, longitude, altitude_m / 1000.0, unit="km", msl=False)
        parts = model.get_Bx(), model.get_By(), model.get_Bz()
        theirs = np.array([np.asarray(part).item() for part in parts])
        ours = 1000.0 * np.array(earth_field(latitude, longitude, altitude_m, day, north="true"))
        differences.append(np.abs(ours - theirs).max())
        fields.append(np.abs(theirs).max())
    return float(max(differences)), float(max(fields))


# -- the command --------------------------------------------------------------------------------------------


def installed(package: str) -> bool:
    """Return whether the package of a reference is installed."""
    return importlib.util.find_spec(package) is not None


def lines() -> Iterator[str]:
    """Yield the results of each reference."""
    yield "tilt of a board in a hand, error in deg (RMS)      still    moved    without what motion adds"
    moved = moved_by_hand()
    for name, (package, _) in FILTERS.items():
        if not installed(package):
            yield f"  {name:<46} {package} is not installed"
            continue
        still, waved, gravity = attitude_errors(moved, name)
        yield f"  {name:<46} {still:7.2f}  {waved:7.2f}  {gravity:7.2f}"
    largest = np.linalg.norm(moved.added_g, axis=1).max()
    yield f"  motion about the wrist adds up to {largest:.2f} g"
    for what, package, unit, compare in (
        ("a passing magnet", "magpylib", "mgauss", magnet_difference_mgauss),
        ("the Earth's field, by NCEI's program", "wmm", "nT", field_difference_nt),
    ):
        if not installed(package):
            yield f"{what}: {package} is not installed"
            continue
        difference, field = compare()
        yield f"{what} ({package}): differs by at most {difference:.2g} {unit} of {field:.6g}"


if __name__ == "__main__":
    for line in lines():
        sys.stdout.write(line + "\n")
