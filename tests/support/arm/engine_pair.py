"""The core and its reference, Unicorn, side by side: with equal state and code, and compared.

Decision: encodings are generated from the bit patterns that the manual prints. Their fields have random permitted
values. So nothing UNPREDICTABLE is executed, no list of exceptions is needed, and the patterns are a second
transcription, independent of the decoder. The random values depend only on the form's name.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore
from fcu_emulator.emulator.chip.cpu.core_registers import (
    CORE,
    EVERYTHING,
    FLOATING_POINT,
    MASKS,
    CoreRegisters,
)
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM, RAM_SIZE
from tests.support.arm.unicorn_reference import THUMB, UnicornCore

CODE = FLASH + 0x1_0000
"""Start of the code. Branches reach flash in both directions, and TBH reaches flash completely."""
GE = 0xF << 16
"""Unicorn cannot set these bits, so they are omitted here; test_native_dsp.py reads them by SEL and MRS."""
RAM_CONTENT = Random("RAM").randbytes(RAM_SIZE)
GENERAL = (*range(13), 14)
"""R0 to R12 and LR, which any 32-bit instruction may name."""

Executing = BareCore | UnicornCore
Fields = Mapping[str, int]
Values = Mapping[str, int]
State = Callable[[Random, Fields], Values]
"""Registers for an encoding with these fields. :class:`Access` has the values of other registers."""

_MODE = "xpsr", "control"
_PRIVILEGED = *MASKS[:3], "msp", "psp"
_OTHERS = *(name for name in CORE[:15] if name != "sp"), *FLOATING_POINT
_HANDLER = THUMB | 15
_NOP = 0xBF00
_SLOT = 32
_EXTREMES = (
    0,
    1,
    31,
    32,
    33,
    0x7FFF,
    0x8000,
    0x7FFF_FFFF,
    0x8000_0000,
    0x8000_8000,
    0x7F80_00FF,
    0xFFFF_FFFF,
)


@dataclass(frozen=True)
class Form:
    """Encodings of an instruction, or of several in sequence.

    Each letter of ``pattern`` is a field; its parts are joined if it is divided. d, n, m, a and t with four bits are
    general registers, unless ``allowed`` has other values; ``rule`` is a condition for all fields.
    """

    name: str
    pattern: str
    allowed: Mapping[str, Sequence[int]] = field(default_factory=dict)
    rule: Callable[[Fields], bool] = lambda _fields: True
    instructions: int = 1

    def __str__(self) -> str:
        return self.name

    def draw(self, random: Random) -> tuple[list[int], Fields]:
        """Draw fields; return the half-words, and the fields."""
        pattern = self.pattern.replace(" ", "")
        widths = {letter: pattern.count(letter) for letter in sorted({*pattern} - {*"01"})}
        while True:
            fields = {letter: random.choice(self._values(letter, width)) for letter, width in widths.items()}
            if self.rule(fields):
                break
        digits = {letter: iter(f"{fields[letter]:0{width}b}") for letter, width in widths.items()}
        code = "".join(next(digits[bit]) if bit in digits else bit for bit in pattern)
        return [int(code[at : at + 16], 2) for at in range(0, len(code), 16)], fields

    def _values(self, letter: str, width: int) -> Sequence[int]:
        general = GENERAL if width == 4 and letter in "dnmat" else range(1 << width)
        return self.allowed.get(letter, general)


def register_name(number: int) -> str:
    """Return the name of R0 to R12 or LR."""
    return "lr" if number == 14 else f"r{number}"


def word(random: Random) -> int:
    """Return a random word, often a word that is special for some instruction."""
    return random.choice(
        (random.getrandbits(32), random.getrandbits(32), random.getrandbits(8), random.choice(_EXTREMES))
    )


def flags(random: Random) -> int:
    """Return an xPSR with any N, Z, C, V and Q."""
    return THUMB | random.getrandbits(5) << 27


def any_values(random: Random, _fields: Fields) -> Values:
    """Return registers for instructions that only compute."""
    return {**{f"r{number}": word(random) for number in range(13)}, "lr": word(random), "xpsr": flags(random)}


class Access:
    """Access to all registers of an engine.

    Unicorn applies the privilege of the code to every access. So the mode is first set to Handler mode, and at the
    end to the requested mode.
    """

    def __init__(self, engine: Executing) -> None:
        self._mode = CoreRegisters(engine, _MODE)
        self._privileged = CoreRegisters(engine, _PRIVILEGED)
        self._others = CoreRegisters(engine, _OTHERS)

    def write(self, values: Values) -> None:
        """Write registers. CONTROL and the mode select MSP or PSP as SP (ARMv7-M ARM B1.4.7)."""
        written = {
            **dict.fromkeys(EVERYTHING, 0),
            "xpsr": THUMB,
            "msp": RAM + 0x8000,
            "psp": RAM + 0xA000,
            **values,
        }
        self._mode.write(_HANDLER, 0)
        self._mode.write(THUMB, 0)
        for registers in (self._privileged, self._others, self._mode):
            registers.write(*(written[name] for name in registers.names))

    def read(self) -> dict[str, object]:
        """Return the registers by name, without GE. Afterwards the engine is in Handler mode."""
        read = dict(zip(_MODE + _OTHERS, (*self._mode.read(), *self._others.read()), strict=True))
        self._mode.write(_HANDLER, read["control"])
        read |= zip(_PRIVILEGED, self._privileged.read(), strict=True)
        return {**read, "xpsr": read["xpsr"] & ~GE}


class EnginePair:
    """The core, ``native``, and its reference, ``unicorn``, with the same code."""

    def __init__(self) -> None:
        self.native, self.unicorn = BareCore(), UnicornCore()
        self._pairs: tuple[tuple[Executing, Access], ...] = (
            (self.native, Access(self.native)),
            (self.unicorn, Access(self.unicorn)),
        )

    def place(self, address: int, words: Sequence[int]) -> None:
        """Write half-words into flash or RAM of both."""
        for engine, _ in self._pairs:
            memory = engine.memory(address, 2 * len(words))
            assert memory is not None
            memory[:] = struct.pack(f"<{len(words)}H", *words)
            engine.invalidate_code()

    def differences(self, address: int, values: Values, instructions: int) -> list[str]:
        """Run both from there with these registers, and return the differences."""
        native, unicorn = (
            _outcome(engine, access, address, values, instructions) for engine, access in self._pairs
        )
        return [_told(name, native[name], unicorn[name]) for name in native if native[name] != unicorn[name]]

    def check(
        self, form: Form, state: State, *, longest_block: int = 4, encodings: int = 16, runs: int = 12
    ) -> None:
        """Check encodings alone and in IT blocks of up to this length, each with some register contents."""
        random = Random(form.name)
        fragments = [_fragment(form, random, random.randint(0, longest_block)) for _ in range(encodings)]
        slots = [words + [_NOP] * (_SLOT // 2 - len(words)) for words, _, _ in fragments]
        self.place(CODE, [word for slot in slots for word in slot])
        for number, (words, fields, instructions) in enumerate(fragments):
            for _ in range(runs):
                values = state(random, fields)
                found = self.differences(CODE + _SLOT * number, values, instructions)
                assert not found, f"{' '.join(f'{word:04X}' for word in words)}: {found} with {_hex(values)}"


def _fragment(form: Form, random: Random, block: int) -> tuple[list[int], Fields, int]:
    """Return one encoding, or IT and a block of encodings: half-words, last fields, number of instructions."""
    drawn = [form.draw(random) for _ in range(block or 1)]
    words = [word for encoding, _ in drawn for word in encoding]
    if block:
        one_bit_each = random.getrandbits(block - 1)  # of the second to the last, then a 1 (A7.3.2)
        mask = (2 * one_bit_each + 1) << 4 - block
        words.insert(0, 0xBF00 | random.randrange(14) << 4 | mask)
    return words, drawn[-1][1], form.instructions * len(drawn) + bool(block)


def _outcome(
    engine: Executing, access: Access, address: int, values: Values, instructions: int
) -> dict[str, object]:
    engine.ram[:] = RAM_CONTENT
    access.write(values)
    engine.pc, engine.thumb = address, True
    stop = engine.run(instructions)
    ended = {"pc": engine.pc, "executed": engine.executed, "stop": stop, "ram": bytes(engine.ram)}
    return access.read() | ended


def _told(name: str, native: object, unicorn: object) -> str:
    if isinstance(native, bytes) and isinstance(unicorn, bytes):
        at = next(at for at in range(RAM_SIZE) if native[at] != unicorn[at])
        name, native, unicorn = f"0x{RAM + at:08X}", native[at : at + 8].hex(), unicorn[at : at + 8].hex()
    told = [f"{value:08X}" if isinstance(value, int) else str(value) for value in (native, unicorn)]
    return f"{name}: native {told[0]}, Unicorn {told[1]}"


def _hex(values: Values) -> str:
    return ", ".join(f"{name}={value:08X}" for name, value in values.items())
