"""Evidence about a stuck program: the latest transfers, and accesses to unusable peripherals."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping

from fcu_emulator.emulator.boards.description import BoardSignals
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.buses.spi import SpiBus
from fcu_emulator.emulator.chip.chip import Chip
from fcu_emulator.emulator.chip.cpu.python_peripherals import GATES
from fcu_emulator.emulator.chip.diagnosis.report import Cause, at
from fcu_emulator.emulator.chip.peripherals.spi import Spi
from fcu_emulator.emulator.chip.registers import spi
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote, Trace
from fcu_emulator.sensors.spi import READ

# -- an I2C address without a device ------------------------------------------------------------------------

_DEVICE_ADDRESSES = range(0x08, 0x78)  # valid addresses of devices (NXP UM10204 table 4)


def nobody(signals: BoardSignals, bus: I2CBus, address: int) -> Cause:
    """Return why no device answers at an address."""
    devices = {
        known: target.name() for known in _DEVICE_ADDRESSES if (target := bus.target(known)) is not None
    }
    short = f"no answer at {bus.name} address 0x{address:02X}"
    if bus.name != signals.wiring.bus:
        return Cause(short, [absent(signals, bus.name)])
    for known, name in devices.items():
        if address == known >> 1:
            meant = f"the {name} is at 0x{known:02X}, 0x{known << 1:02X} as HAL address"
            return Cause(
                f"{short}: the HAL needs the address shifted left, 0x{known << 1:02X}, not 0x{known:02X}",
                [
                    f"HAL_I2C_Mem_Read and similar functions take the address in 8 bits: {meant} (0x{known:02X} << 1)."
                ],
            )
        if address == known << 1 & 0x7F:
            return Cause(f"{short}: the address was shifted left twice", [_answers(name, known)])
        if address == known ^ 1:
            return Cause(
                f"{short}: the {name} answers at 0x{known:02X} (0x{known << 1:02X} as HAL address)",
                [f"Its address pin is {'high' if known & 1 else 'low'} on this board."],
            )
    return Cause(short, [_answers(name, known) for known, name in devices.items()])


def absent(signals: BoardSignals, used: str) -> str:
    """Report that the sensors are on another bus."""
    wiring, other = signals.wiring, signals.board.wiring_with(used)
    text = f"With wiring {wiring.name} the sensors are on {wiring.bus}, not on {used}: "
    text += f"build the firmware for {wiring.bus}"
    if other:
        return f"{text}, or run it with wiring {other.name}."
    if used == "I2C1":
        return f"{text}. ST's Nucleo boards have their sensor shields on I2C1; was the program made for such a board?"
    return f"{text}."


def _answers(name: str, address: int) -> str:
    return f"The {name} answers at 0x{address:02X}, 0x{address << 1:02X} as HAL address."


# -- the latest transfers -----------------------------------------------------------------------------------

TRANSFERS_SHOWN = 8
_MANY = 6
"""This many consecutive reads of 0xFF prove a fault: no sensor measures -1 on all axes that often."""


class RecentTransfers:
    """The latest transfers on the board's buses."""

    def __init__(self, signals: BoardSignals) -> None:
        self._signals = signals
        self._i2c, self._spi = list(signals.i2c.values()), list(signals.spi.values())
        self._now_ps = signals.clock.now_ps
        every = [transfer for bus in self._i2c for transfer in bus.recent_transfers()]
        every += [transfer for bus in self._spi for transfer in bus.recent_transfers()]
        self.latest = sorted(every, key=lambda transfer: transfer.t_ps)[-TRANSFERS_SHOWN:]

    @property
    def last_ps(self) -> int:
        unaddressed_ps = (bus.unaddressed[-1][0] for bus in self._spi if bus.unaddressed)
        return max([0, *unaddressed_ps, *(transfer.end_ps for transfer in self.latest)])

    def lines(self) -> list[str]:
        lines = self.texts(self.latest)
        lines += [
            f"{at(bus.unaddressed[-1][0])}  {bus.name} {unaddressed}, while no sensor was selected"
            for bus in self._spi
            if (unaddressed := self._unaddressed(bus))
        ]
        return lines

    def texts(self, transfers: Iterable[BusTransfer]) -> list[str]:
        return [f"{at(transfer.t_ps)}  {_text(transfer, self._signals.i2c)}" for transfer in transfers]

    def failure(self) -> Cause | None:
        """Return the cause if a line is held low or the latest transfer failed."""
        for bus in self._i2c:
            if any(fault.kind == "stuck" for fault in bus.faults(self._now_ps)):
                text = f"a line of {bus.name} is held low"
                return Cause(text, ["The bus stays busy, so no transfer can start."])
        failed = self.latest and self.latest[-1].result != "ok"
        return self._failed(self.latest[-1]) if failed else None

    def cause(self) -> Cause | None:
        for bus in self._spi:
            if unaddressed := self._unaddressed(bus):
                return self._no_sensor_selected(bus, unaddressed)
        if not self.latest:
            return None
        last = self.latest[-1]
        if last.register == "WHO_AM_I" and last.read:
            return self._identity(last)
        return None

    def silent_sensors(self) -> Cause | None:
        """Report that all reads returned 0xFF, or that all returned 0x00.

        One of the reads must be of WHO_AM_I, or at least ``_MANY`` reads must have returned 0xFF.
        """
        reads = [transfer for transfer in self.latest if transfer.read]
        values = {value for transfer in reads for value in transfer.read}
        identified = any(transfer.register == "WHO_AM_I" for transfer in reads)
        if values not in ({0xFF}, {0x00}) or not (identified or (len(reads) >= _MANY and values == {0xFF})):
            return None
        (value,) = values
        bus, what = reads[-1].bus, "WHO_AM_I of every sensor" if identified else "every register"
        sentences = self._dead_line(bus)
        used = [one.name for one in self._i2c if one.recent_transfers()]
        used += [one.name for one in self._spi if one.recent_transfers() or one.unaddressed]
        for wiring in self._signals.board.wirings:
            if wiring.bus not in used:
                nothing = f"On {wiring.bus} there were no transfers"
                sentences.append(f"{nothing}; firmware for {wiring.bus} runs with wiring {wiring.name}.")
        return Cause(f"{what} is read as 0x{value:02X} over {bus}", sentences)

    def _dead_line(self, bus: str) -> list[str]:
        if bus not in self._signals.spi:
            return ["Check the register number."]
        return [
            "No device drives the data line. The sensors answer on their input line (three wires),",
            "in mode 3 (SPI_POLARITY_HIGH, SPI_PHASE_2EDGE), with one chip select low at a time.",
        ]

    def nobody_on_spi(self) -> Cause | None:
        for bus in self._spi:
            if not bus.chip_selects and self._unaddressed(bus):
                return Cause(
                    f"{bus.name} is used, but no sensor is on {bus.name} with this wiring",
                    [
                        "No device drives the data line: each byte is read as 0xFF, even the byte of WHO_AM_I.",
                        absent(self._signals, bus.name),
                    ],
                )
        return None

    def _failed(self, last: BusTransfer) -> Cause:
        bus = self._signals.i2c[last.bus]  # SPI transfers cannot fail
        if not last.device:
            return nobody(self._signals, bus, last.address)
        ruled = [fault for fault in bus.faults(last.t_ps) if fault.address in (None, last.address)]
        why = "The scenario breaks this bus at that time." if ruled else "The device is present."
        return Cause(last.result, [why])

    def _unaddressed(self, bus: SpiBus) -> str:
        since_ps = max((transfer.end_ps for transfer in self.latest), default=0)
        bytes_ = [value for t_ps, value in bus.unaddressed if t_ps > since_ps]
        sent = " ".join(f"{value:02X}" for value in bytes_ if value is not None)
        read = sum(value is None for value in bytes_)
        what = [f"sent {sent}"] if sent else []
        return " and ".join(what + ([f"read {read} byte{'s' * (read > 1)}, 0xFF"] if read else []))

    def _no_sensor_selected(self, bus: SpiBus, unaddressed: str) -> Cause:
        if not bus.chip_selects:
            return Cause(
                f"{bus.name} {unaddressed}, but no sensor is on {bus.name} with this wiring",
                [absent(self._signals, bus.name)],
            )
        selects = ", ".join(bus.chip_selects)
        return Cause(
            f"{bus.name} {unaddressed}, while no sensor was selected",
            [f"Drive one of the chip selects ({selects}) low around the transfer."],
        )

    def _identity(self, last: BusTransfer) -> Cause:
        value, expected = last.read[0], self._signals.board.identities[last.device]
        read = f"WHO_AM_I of {last.device} was read over {last.bus} and returned 0x{value:02X}"
        if value == expected:
            return Cause(
                f"{read}, the expected value",
                [f"The program seems to expect another part: a {last.device} answers 0x{value:02X}."],
            )
        if last.bus in self._signals.spi:
            needs = "mode 3, three wires, one chip select low at a time"
            hint = f"Check that {last.bus} is set up as the part needs it: {needs}."
        else:
            hint = "Check the address, and the register number."
        return Cause(f"{read}; expected 0x{expected:02X}", [hint])


def _text(transfer: BusTransfer, i2c: Mapping[str, I2CBus]) -> str:
    if transfer.bus in i2c:
        who = f"{transfer.bus} 0x{transfer.address:02X} {transfer.device}".rstrip()
        data, first = transfer.written[1:], transfer.written[:1]
    else:
        who = f"{transfer.bus} {transfer.device}"
        data, first = transfer.written[1:], bytes((transfer.address & ~READ,)) if transfer.written else b""
    if transfer.result != "ok":
        return f"{who}: {transfer.result.partition(': ')[2] or transfer.result}"
    where = f"{transfer.register} (0x{first[0]:02X})" if first else ""
    actions = []
    if data or not transfer.read:
        actions.append(f"write {where}: {data.hex(' ').upper()}" if data else f"write {where}".rstrip())
    if transfer.read:
        actions.append(f"read {where}: {transfer.read.hex(' ').upper()}")
    return f"{who}: {', '.join(actions)}"


# -- an SPI that transfers nothing (RM0368 20.3.4, 20.5) ----------------------------------------------------

_CR1, _SR = offsets(spi.CR1, spi.SR)
_SPE, _BIDIMODE, _BIDIOE = masks(spi.CR1.SPE, spi.CR1.BIDIMODE, spi.CR1.BIDIOE)
_RXNE, _TXE = masks(spi.SR.RXNE, spi.SR.TXE)


def why_no_byte(master: Spi) -> str:
    """Return why an SPI transfers no byte; "" if its registers do not show the reason."""
    name, cr1, sr = master.name, master.peek(_CR1), master.peek(_SR)
    if not cr1 & _SPE:
        return f"SPE in {name}_CR1 is 0, so {name} transfers no byte."
    if not cr1 & _BIDIMODE:
        return ""
    if not cr1 & _BIDIOE and not sr & _TXE:
        return f"BIDIOE in {name}_CR1 is 0, so {name} receives, and never sends the byte in DR."
    if cr1 & _BIDIOE and not sr & _RXNE:
        return f"BIDIOE in {name}_CR1 is 1, so {name} sends, and receives no byte."
    return ""


# -- accesses without effect -------------------------------------------------------------------------------------

_NOTES_SHOWN = 6


class PeripheralNotes:
    """Accesses to peripherals that cannot be used, in order of time."""

    def __init__(self, chip: Chip, trace: Trace) -> None:
        self._clocked = {peripheral.name: peripheral.clocked for peripheral in chip.core.all_peripherals}
        self._clocked_until_ps = chip.system.rcc.clocked_until_ps
        self._notes = [
            note for note in trace.of(DeviceNote) if note.what == "forbidden" and note.device in self._clocked
        ]

    def without_clock(self) -> list[str]:
        """Return peripherals to which firmware wrote while their clock was off, and whose clock was never
        switched on later."""
        first_ps: dict[str, int] = {}
        for note in self._notes:
            if note.problem == "written-without-clock":
                first_ps.setdefault(note.device, note.t_ps)
        return [
            name
            for name, t_ps in first_ps.items()
            if not self._clocked[name] and self._clocked_until_ps.get(name, -1) <= t_ps
        ]

    def cause(self, among: Container[str] | None = None) -> Cause | None:
        """Report the first peripheral without clock; if ``among`` is given, check only these names."""
        for name in self.without_clock():
            if among is not None and name not in among:
                continue
            first = next(note for note in self._notes if note.device == name)
            return Cause(
                f"{name} has no clock: __HAL_RCC_{name}_CLK_ENABLE() is missing",
                [
                    (
                        f"{GATES[name]} is 0, so writes to the peripheral have no effect and reads return 0; "
                        f"first used at {at(first.t_ps)}."
                    )
                ],
            )
        return None

    def lines(self) -> list[str]:
        """Return the first notes as text lines."""
        lines = [f"{at(note.t_ps)}  {note.device} {note.text}" for note in self._notes]
        return lines[:_NOTES_SHOWN] + (
            [f"({len(lines) - _NOTES_SHOWN} more not shown)"] if len(lines) > _NOTES_SHOWN else []
        )
