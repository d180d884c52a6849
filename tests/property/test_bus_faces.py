"""The same traffic over I2C and over SPI with three and four wires, compared with an oracle.

Three copies of a sensor have the same world and time. All writes go to all copies, each over its own bus, and all
reads must be equal. A slow and simple oracle also predicts registers that only store a value (write masks and resets
from the second transcription of the datasheets, ``tests/fixtures/registers``), and the output words with and without
BDU.
"""

from __future__ import annotations

import csv
from pathlib import Path

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from tests.support.bus_faces import COUNTS_PER_SAMPLE, Face
from tests.support.sensor_fakes import ACCELEROMETER, FACTS, MAGNETOMETER, PRESSURE, Channel, Writes

FIXTURES = Path(__file__).parents[1] / "fixtures" / "registers"
BYTE = st.integers(0, 0xFF)


def transcription(part: str) -> dict[int, tuple[int, int]]:
    """Return reset value and write mask of each address of the main bank that has both as numbers."""
    with (FIXTURES / f"{part.lower()}.csv").open(encoding="utf-8", newline="") as table:
        return {
            int(row["address"], 16): (int(row["reset"], 16), int(row["write_mask"], 16))
            for row in csv.DictReader(table)
            if row["bank"] == "main" and row["reset"].startswith("0x") and row["write_mask"].startswith("0x")
        }


class FacesMachine(RuleBasedStateMachine):
    """State machine with permitted register traffic and time."""

    channel: Channel
    plain: tuple[int, ...]  # registers that only hold a value, whatever they set up
    control: int  # the register with BDU
    bdu: int
    increment: tuple[int, int] | None  # register and bit of IF_INC
    wires: int  # the register that selects three wires or four
    three: int  # its bits for three wires
    four: int
    start: Writes  # beside the channel's own set-up; the control register's other bits

    @initialize()
    def power_up(self) -> None:
        self.wire_bits = self.three | self.four
        self.faces = [
            Face(self.channel, "I2C", self.wires, 0),
            Face(self.channel, "SPI3", self.wires, self.three),
            Face(self.channel, "SPI4", self.wires, self.four),
        ]
        table = transcription(self.channel.part)
        self.masks = {address: table[address][1] for address in self.plain}
        self.memory = {address: table[address][0] for address in self.plain}
        self.settings = dict(self.start)
        self.t_ps = 0
        self.latest = -1
        self.shown = bytes(self.channel.size)
        self.begun: dict[int, set[int]] = {}  # with BDU: bytes read of each word, until all have been
        for address, value in self.start:
            self.write(address, bytes([value]))
        for address, value in self.channel.scales[0][0]:
            if address not in self.settings:
                self.write(address, bytes([value]))

    # -- the three copies ---------------------------------------------------------------------------------

    def write(self, address: int, data: bytes) -> None:
        for face in self.faces:
            face.write(address, data, self.wire_bits)

    def read(self, address: int, count: int) -> bytes:
        """Return the bytes that all three copies show. Bits that select the wires differ and are not compared."""
        addresses = self.walk(address, count)
        answers = []
        for face in self.faces:
            data = bytearray(face.read(address, count))
            for offset, at in enumerate(addresses):
                if at == self.wires:
                    data[offset] &= ~self.wire_bits
            answers.append(bytes(data))
        assert answers[0] == answers[1] == answers[2]
        return answers[0]

    # -- the oracle -----------------------------------------------------------------------------------------

    def increments(self) -> bool:
        return self.increment is None or bool(self.settings[self.increment[0]] & self.increment[1])

    def walk(self, address: int, count: int) -> list[int]:
        """Return the address of each byte of a burst."""
        visited = []
        for _ in range(count):
            visited.append(address)
            if self.increments():
                address = FACTS[self.channel.part].next_address.get(address, (address + 1) % 0x80)
        return visited

    def sample(self) -> bytes:
        """Return the latest sample as the output registers have it."""
        counts = [COUNTS_PER_SAMPLE * (self.latest + 1) + 1000 * axis for axis in range(self.channel.axes)]
        words = [count if self.latest >= 0 else 0 for count in counts]
        return b"".join(
            min(word, self.channel.limits[1]).to_bytes(self.channel.width, "little") for word in words
        )

    def output_byte(self, offset: int) -> int:
        word, byte = divmod(offset, self.channel.width)
        held = self.begun.setdefault(word, set())
        if not held:
            first = word * self.channel.width
            fresh = self.sample()[first : first + self.channel.width]
            self.shown = self.shown[:first] + fresh + self.shown[first + self.channel.width :]
        if self.settings[self.control] & self.bdu:
            self.hold(held, byte)
        return self.shown[offset]

    def hold(self, held: set[int], byte: int) -> None:
        """LSM6DSL and LIS2MDL: hold a pair until its other byte is read (AN5040 4.4, AN5069 6.4)."""
        held.add(byte)
        if len(held) == self.channel.width:
            held.clear()

    # -- traffic --------------------------------------------------------------------------------------------

    @rule(periods=st.one_of(st.sampled_from((0.3, 1.0)), st.floats(0, 4)))
    def time_passes(self, periods: float) -> None:
        self.t_ps += int(periods * 1e12 / self.channel.rate_hz)
        for face in self.faces:
            face.chip.t_ps = self.t_ps
        while self.channel.sample_ps(self.latest + 1) <= self.t_ps:
            self.latest += 1

    @rule(data=st.data(), values=st.lists(BYTE, min_size=1, max_size=4))
    def write_registers(self, data: st.DataObject, values: list[int]) -> None:
        address = data.draw(st.sampled_from(self.plain))
        visited = self.walk(address, len(values))
        while not set(visited) <= set(self.plain):
            visited.pop()
        for at, value in zip(visited, values, strict=False):
            self.memory[at] = self.memory[at] & ~self.masks[at] | value & self.masks[at]
        self.write(address, bytes(values[: len(visited)]))

    @rule(data=st.data())
    def read_a_word_in_two(self, data: st.DataObject) -> None:
        width = self.channel.width
        first = self.channel.address + width * data.draw(st.integers(0, self.channel.axes - 1))
        cut = data.draw(st.integers(1, width - 1))
        self.read_anywhere(first, cut)
        self.time_passes(data.draw(st.floats(1, 4)))
        self.read_anywhere(first + cut, width - cut)

    @rule(bdu=st.booleans(), increments=st.booleans())
    def configure(self, bdu: bool, increments: bool) -> None:
        self.settings[self.control] = self.settings[self.control] & ~self.bdu | bdu * self.bdu
        if self.increment is not None:
            address, bit = self.increment
            self.settings[address] = self.settings[address] & ~bit | increments * bit
        for address, value in self.settings.items():
            self.write(address, bytes([value]))
        if not bdu:
            self.begun.clear()

    @rule(address=st.integers(0, 0x7F), count=st.integers(1, 24))
    def read_anywhere(self, address: int, count: int) -> None:
        found = self.read(address, count)
        first = self.channel.address
        for at, value in zip(self.walk(address, count), found, strict=True):
            if at in self.memory:
                assert value == self.memory[at]
            elif first <= at < first + self.channel.size:
                assert value == self.output_byte(at - first)

    @rule(data=st.data(), count=st.integers(1, 8))
    def read_output(self, data: st.DataObject, count: int) -> None:
        self.read_anywhere(self.channel.address + data.draw(st.integers(0, self.channel.size - 1)), count)


class Lsm6dslFaces(FacesMachine):
    channel = ACCELEROMETER
    plain = (0x06, 0x07, 0x08, 0x09, 0x0B, 0x0D, 0x0E, 0x59, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E, 0x5F)
    control, bdu, increment = 0x12, 0x40, (0x12, 0x04)
    wires, three, four = 0x12, 0x08, 0x00
    start = ((0x12, 0x04),)


class Lis2mdlFaces(FacesMachine):
    channel = MAGNETOMETER
    plain = (0x63, 0x65, 0x66)
    control, bdu, increment = 0x62, 0x10, None
    wires, three, four = 0x62, 0x00, 0x04
    start = ((0x62, 0x00),)


class Lps22hbFaces(FacesMachine):
    channel = PRESSURE
    plain = (0x0C, 0x0D, 0x12, 0x14, 0x15, 0x16, 0x17)
    control, bdu, increment = 0x10, 0x02, (0x11, 0x10)
    wires, three, four = 0x10, 0x01, 0x00
    start = ((0x11, 0x10), (0x10, 0x50))

    def hold(self, held: set[int], byte: int) -> None:
        """Hold the pressure from the read of its first byte to the read of its high byte (datasheet 9.5)."""
        held.add(byte)
        if byte == 2:
            held.clear()


MACHINES = (Lsm6dslFaces, Lis2mdlFaces, Lps22hbFaces)

for machine in MACHINES:
    machine.TestCase.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)

TestLsm6dsl = Lsm6dslFaces.TestCase
TestLis2mdl = Lis2mdlFaces.TestCase
TestLps22hb = Lps22hbFaces.TestCase
