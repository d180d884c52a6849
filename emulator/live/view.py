"""What is shown of a board while it runs. Looking changes nothing: registers are shown as they stand in the
part's memory, so an output register has the sample that was read last, and reading a status here clears no
bit.

Samples are what the firmware itself has read last on its bus, decoded with the part's own full scale of the
moment. The road not taken, asking the sensors, would show samples that no firmware has seen.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from emulator.analysis.witness import Witness
from emulator.board.board import Board
from emulator.buses.i2c import I2CBus
from emulator.time.clock import PS_PER_S
from emulator.trace import BusTransfer, TraceEvent
from emulator.world.track import Array
from sensors.part import Part
from sensors.register import RegisterMap

_KEPT = 16  # transfers of firmware in Python
_MOST_LEAVES = 16  # numbers of one variable that are shown
_LOOKS_OF_LOAD = 400  # of the witness: two seconds of virtual time


# -- The world ----------------------------------------------------------------------------------------------


def truth(board: Board) -> dict[str, Any]:
    """What the world is at this moment, in the board's axes where it has any.

    ``rotation``: board to world (x north, y west, z up), nine numbers by rows.
    """
    world, now = board.world, instant(board)
    rotation = world.rotation(now)[0]
    roll, pitch, yaw = world.attitude_deg(now)[0]
    return {
        "rotation": [round(float(one), 6) for one in rotation.flat],
        "roll_deg": _short(roll),
        "pitch_deg": _short(pitch),
        "yaw_deg": _short(yaw),
        "altitude_m": _short(world.altitude_m(now)[0]),
        "rate_dps": _vector(world.angular_rate_dps(now)[0]),
        "acc_mg": _vector(1000.0 * world.specific_force_g(now)[0]),
        "mag_mgauss": _vector(world.magnetic_field_mgauss(now)[0]),
        "pressure_hpa": _short(world.pressure_hpa(now)[0]),
        "temperature_degc": _short(world.temperature_degc(now)[0]),
        "humidity_percent": _short(world.relative_humidity_percent(now)[0]),
    }


def instant(board: Board) -> Array:
    """Now, as the world takes times: (1,)."""
    return np.array([board.now_s])


def _short(value: Any) -> float:
    return round(float(value), 4) + 0.0  # no negative zero


def _vector(values: Any) -> list[float]:
    return [_short(one) for one in values]


# -- What the bus carries -----------------------------------------------------------------------------------


class Output(NamedTuple):
    """What a burst from an output register means: a quantity of the part, as the page calls it."""

    shown: str
    quantity: str
    bytes_each: int
    axes: int
    unit: str
    scale: float
    """The unit shown over the part's own."""


OUTPUTS: Mapping[tuple[str, str], Output] = {
    ("LSM6DSL", "OUTX_L_XL"): Output("ACC", "acceleration_g", 2, 3, "mg", 1000.0),
    ("LSM6DSL", "OUTX_L_G"): Output("GYR", "angular_rate_dps", 2, 3, "mdps", 1000.0),
    ("LIS2MDL", "OUTX_L_REG"): Output("MAG", "magnetic_field_mgauss", 2, 3, "mG", 1.0),
    ("LPS22HB", "PRESS_OUT_XL"): Output("PRE", "pressure_hpa", 3, 1, "hPa", 1.0),
    ("LPS22HB", "TEMP_OUT_L"): Output("TEMP", "temperature_degc", 2, 1, "°C", 1.0),
}


def decoded(board: Board, transfer: BusTransfer) -> tuple[Output, list[float]] | None:
    """The values that a read of output registers brought; None for any other transfer.

    Little endian, as all three parts are after reset; the zero of a temperature is the part's.
    """
    output = OUTPUTS.get((transfer.device, transfer.register))
    if output is None or len(transfer.read) < output.bytes_each * output.axes:
        return None
    low, high, lsb = board.sensors[transfer.device].sample_range(output.quantity)
    zero = 0.0
    if output.quantity == "temperature_degc":
        zero = (low + high + lsb) / 2
    values = []
    for axis in range(output.axes):
        raw = transfer.read[axis * output.bytes_each : (axis + 1) * output.bytes_each]
        count = int.from_bytes(raw, "little", signed=True)
        values.append(round((zero + count * lsb) * output.scale, 3))
    return output, values


class Transfers:
    """The latest transfers. The chip keeps a few; those of firmware in Python are taken down here."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._kept: deque[BusTransfer] = deque(maxlen=_KEPT)
        self._unsubscribe: Callable[[], object] = bool
        if board.arm is None:
            self._unsubscribe = board.trace.subscribe(self._hear)

    def latest(self) -> list[BusTransfer]:
        """The latest last."""
        return list(self._kept) if self._board.arm is None else self._board.recent_transfers()

    def close(self) -> None:
        """Hear no more."""
        self._unsubscribe()

    def _hear(self, event: TraceEvent) -> None:
        if isinstance(event, BusTransfer):
            self._kept.append(event)


def samples(board: Board, latest: Sequence[BusTransfer]) -> dict[str, list[float]]:
    """What the firmware has read last, by quantity, in the sensor's own axes."""
    found = {}
    for transfer in latest:
        read = decoded(board, transfer)
        if read is not None:
            found[read[0].shown] = read[1]
    return found


def transfers(board: Board, latest: Sequence[BusTransfer]) -> list[dict[str, Any]]:
    """The latest transfers on all buses, for people."""
    return [_transfer(board, one) for one in latest]


def _transfer(board: Board, transfer: BusTransfer) -> dict[str, Any]:
    read = decoded(board, transfer)
    meaning = ""
    if read is not None:
        output, values = read
        meaning = " ".join(f"{value:g}" for value in values) + f" {output.unit}"
    data = transfer.read or transfer.written[1:]
    return {
        "t_s": transfer.t_ps / PS_PER_S,
        "bus": transfer.bus,
        "device": transfer.device or f"0x{transfer.address:02X}",
        "register": transfer.register,
        "way": "read" if transfer.read else "write",
        "bytes": data[:32].hex(" "),
        "count": len(data),
        "meaning": meaning,
        "result": transfer.result,
    }


# -- Registers ----------------------------------------------------------------------------------------------


def vocabulary(board: Board) -> list[dict[str, Any]]:
    """Each part's registers and fields as declared, for the page to decode with."""
    return [
        {
            "name": part.NAME,
            "doc": ", ".join(quantity.doc for quantity in part.SIGNALS),
            "place": _place(board, part),
            "registers": list(_declared(part.MAP)),
        }
        for part in board.sensors
    ]


def _place(board: Board, part: Part) -> str:
    profile = board.booted.profile
    place = profile.places.get(part.NAME)
    return f"{profile.bus}, {f'0x{place:02X}' if isinstance(place, int) else place}"


def _declared(registers: RegisterMap) -> Iterator[dict[str, Any]]:
    for one in registers.registers:
        yield {
            "name": one.__name__,
            "address": one.addr,
            "size": one.size,
            "reset": one.reset,
            "access": one.access,
            "doc": (one.__doc__ or "").strip().splitlines()[0] if one.__doc__ else "",
            "modelled": one.modelled,
            "fields": [
                {"name": bits.name, "msb": bits.msb, "lsb": bits.lsb, "doc": bits.doc}
                for bits in one.fields
                if not bits.overlay
            ],
        }


def registers(board: Board, part: str) -> str:
    """The main bank of a part as it stands, in hexadecimal. Raises InputError for an unknown part."""
    return bytes(board.sensors[part].registers.mem).hex()


# -- Variables ----------------------------------------------------------------------------------------------


def variable_names(board: Board) -> list[str]:
    """Global variables of the firmware, in alphabetical order; of firmware in Python its numbers."""
    if board.arm is not None:
        symbols = board.arm.image.symbols
        return sorted({one.name for one in symbols.variables() if one.size}) if symbols else []
    return [
        name
        for name in ("acc", "gyro", "mag", "press", "pitch", "roll", "yaw", "altitude")
        if _has(board, name)
    ]


def _has(board: Board, name: str) -> bool:
    try:
        board.variable(name)
    except KeyError:
        return False
    return True


def variable(board: Board, path: str) -> dict[str, float]:
    """The numbers of a variable by path: ``pitch``, or ``acc.AXIS_X`` of a structure, ``a[0]`` of an array.

    Nothing where there is no such variable or it is no number.
    """
    name, _, member = path.partition(".")
    try:
        value = board.variable(name)
    except KeyError:
        return {}
    leaves = dict(_leaves(name, value))
    if member:
        return {path: leaves[path]} if path in leaves else {}
    return leaves


def _leaves(name: str, value: Any, depth: int = 3) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float | np.number):
        number = float(value)
        if np.isfinite(number):
            yield name, number
    elif depth and isinstance(value, tuple | list):
        for index, one in enumerate(value[:_MOST_LEAVES]):
            yield from _leaves(f"{name}[{index}]", one, depth - 1)
    elif depth and not isinstance(value, str | bytes):
        members = getattr(value, "__dict__", None) or {
            key: getattr(value, key) for key in getattr(value, "_fields", getattr(value, "__slots__", ()))
        }
        for key, one in list(members.items())[:_MOST_LEAVES]:
            if not key.startswith("_"):
                yield from _leaves(f"{name}.{key}", one, depth - 1)


# -- How busy everything is ---------------------------------------------------------------------------------


class Load:
    """How busy callback, chip and serial line are, of the latest two seconds or so."""

    def __init__(self, board: Board, witness: Witness) -> None:
        self._board = board
        self._witness = witness
        self._before = 0, 0
        self._share = 0.0
        self._printed = 0, 0
        self._line = 0.0

    def figures(self) -> dict[str, float]:
        """Numbers by name: the timer's, the callback's time in ms, the share of the line that was busy."""
        board, timer = self._board, self._board.timer
        looks, seen = self._witness.looks_at_callback, self._witness.callback_seen
        if looks - self._before[0] >= _LOOKS_OF_LOAD:
            self._share = (seen - self._before[1]) / (looks - self._before[0])
            self._before = looks, seen
        elif self._before == (0, 0) and looks:
            self._share = seen / looks
        now_ps, count = board.clock.now_ps, board.terminal.uart.received_count()
        passed_ps = now_ps - self._printed[0]
        if passed_ps >= PS_PER_S:
            self._line = (count - self._printed[1]) * board.terminal.uart.frames_ps(1) / passed_ps
            self._printed = now_ps, count
        rate_hz = timer.rate_hz if timer.ticks else 0.0
        period_ms = 1000.0 / rate_hz if rate_hz else 0.0
        return {
            "rate_hz": round(rate_hz, 3),
            "ticks": timer.ticks,
            "late": timer.late,
            "lost": timer.lost,
            "longest_wait_ms": round(1000 * timer.longest_wait_s, 4),
            "period_ms": round(period_ms, 4),
            "callback_ms": round(self._share * period_ms, 3),
            "callback_share": round(self._share, 3),
            "line_share": round(self._line, 3),
            **_speeds(board),
        }


def _speeds(board: Board) -> dict[str, float]:
    """Clock rates of the buses that the firmware uses, and the serial line's bit rate.

    Firmware in Python uses its profile's bus; its transfers are kept only while somebody looks at them.
    """
    found: dict[str, float] = {"baud": round(10 * PS_PER_S / board.terminal.uart.frames_ps(1))}
    buses: list[Any] = [*board.signals.i2c.values(), *board.signals.spi.values()]
    for bus in buses:
        if bus.recent_transfers() or (board.arm is None and bus.name == board.booted.profile.bus):
            found["bus_hz"] = bus.speed_hz
            found["bus_is_i2c"] = isinstance(bus, I2CBus)
    return found
