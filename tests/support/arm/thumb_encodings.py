"""Encodings of the test assembler's instructions (ARMv7-M ARM A7.7): pure functions of their operands."""

from __future__ import annotations

import re
from collections.abc import Callable

CONDITIONS = ("eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le")

_PLAIN = {
    "nop": (0xBF00,),
    "yield": (0xBF10,),
    "wfe": (0xBF20,),
    "wfi": (0xBF30,),
    "sev": (0xBF40,),
    "dsb": (0xF3BF, 0x8F4F),
    "isb": (0xF3BF, 0x8F6F),
    "clrex": (0xF3BF, 0x8F2F),
}
_CPS = {"cpsie": 0xB660, "cpsid": 0xB670}
_NUMBERED = {"svc": 0xDF00, "udf": 0xDE00, "bkpt": 0xBE00}
_IMMEDIATE_8 = {"movs": 0x2000, "cmp": 0x2800, "adds": 0x3000, "subs": 0x3800}
_THREE_REGISTERS = {"adds": 0x1800, "subs": 0x1A00}
_TWO_REGISTERS = {
    "ands": 0x4000,
    "eors": 0x4040,
    "tst": 0x4200,
    "cmp": 0x4280,
    "orrs": 0x4300,
    "bics": 0x4380,
}
_MEMORY = {"ldr": 0xF8D0, "ldrh": 0xF8B0, "ldrb": 0xF890, "str": 0xF8C0, "strh": 0xF8A0, "strb": 0xF880}
_PAIR = {"ldrd": 0xE950, "strd": 0xE940}
_MULTIPLE = {"ldmia": 0xE890, "stmia": 0xE880, "ldmdb": 0xE910, "stmdb": 0xE900}
_FLOATING_MULTIPLE = {"vldmia": 0xEC90, "vstmia": 0xEC80, "vstmdb": 0xED00}
_DIVIDE = {"sdiv": 0xFB90, "udiv": 0xFBB0}
_BRANCH_REGISTER = {"bx": 0x4700, "blx": 0x4780}
_SPECIAL_REGISTERS = {
    "apsr": 0,
    "ipsr": 5,
    "xpsr": 3,
    "msp": 8,
    "psp": 9,
    "primask": 16,
    "basepri": 17,
    "basepri_max": 18,
    "faultmask": 19,
    "control": 20,
}
_NAMED = {"sp": 13, "lr": 14, "pc": 15}

Labels = dict[str, int]


class Place:
    """The address of an instruction, and the addresses of labels."""

    def __init__(self, address: int, labels: Labels | None) -> None:
        self.address = address
        self._labels = labels

    def value(self, text: str) -> int:
        """Return the value of a number, or of a label with an optional ``+number``."""
        if re.match(r"[\d-]", text):
            return int(text, 0)
        name, _, plus = text.partition("+")
        base = self.address if name == "." or self._labels is None else self._labels[name]
        return base + (int(plus, 0) if plus else 0)

    def distance(self, text: str, bits: int) -> int:
        """Return the distance from PC to a label in half-words, as a field of this many bits."""
        distance = (self.value(text) - self.address - 4) // 2
        assert -(1 << bits - 1) <= distance < 1 << bits - 1, f"{text} is out of reach"
        return distance & (1 << bits) - 1


def encode(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    for encoder in _ENCODERS:
        words = encoder(name, operands, place)
        if words is not None:
            return words
    return None


def _register(text: str) -> int:
    return _NAMED[text] if text in _NAMED else int(text[1:])


def _number(text: str) -> int:
    return int(text.removeprefix("#"), 0)


def _list(text: str, prefix: str) -> list[int]:
    """Return the numbers in ``{r0-r3, lr}``."""
    numbers: list[int] = []
    for part in text.strip("{}").split(","):
        first, _, last = part.strip().partition("-")
        if first in _NAMED:
            numbers.append(_NAMED[first])
        else:
            low = int(first.removeprefix(prefix))
            numbers += range(low, int(last.removeprefix(prefix) or low) + 1 if last else low + 1)
    return numbers


def _mask(text: str) -> int:
    return sum(1 << number for number in _list(text, "r"))


def _simple(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name in _PLAIN:
        return _PLAIN[name]
    if name in _CPS:
        return (_CPS[name] | 2 * ("i" in operands[0]) | ("f" in operands[0]),)
    if name in _NUMBERED:
        return (_NUMBERED[name] | _number(operands[0]),)
    if name == ".word":
        value = place.value(operands[0])
        return value & 0xFFFF, value >> 16
    if re.fullmatch("i[te]{1,4}", name) and name[1] == "t":
        return (_it(name[2:], CONDITIONS.index(operands[0])),)
    return None


def _it(further: str, condition: int) -> int:
    """Encode IT: the mask has one bit for each further instruction, followed by a 1 (A7.3.2)."""
    bits = [(condition & 1) ^ (letter == "e") for letter in further] + [1]
    mask = sum(bit << 3 - index for index, bit in enumerate(bits))
    return 0xBF00 | condition << 4 | mask


def _wide_immediate(code: int, register: int, value: int) -> tuple[int, int]:
    return code | value >> 12 | (value >> 11 & 1) << 10, (value >> 8 & 7) << 12 | register << 8 | value & 0xFF


def _moves(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name == "mov32":
        register, value = _register(operands[0]), place.value(operands[1])
        low, high = value & 0xFFFF, value >> 16
        return *_wide_immediate(0xF240, register, low), *_wide_immediate(0xF2C0, register, high)
    if name in ("movw", "movt"):
        code = 0xF240 if name == "movw" else 0xF2C0
        return _wide_immediate(code, _register(operands[0]), _number(operands[1]))
    if name == "mov":
        to, source = _register(operands[0]), _register(operands[1])
        return (0x4600 | (to & 8) << 4 | source << 3 | to & 7,)
    if name == "mrs":
        return 0xF3EF, 0x8000 | _register(operands[0]) << 8 | _SPECIAL_REGISTERS[operands[1]]
    if name == "msr":
        return 0xF380 | _register(operands[1]), 0x8800 | _SPECIAL_REGISTERS[
            operands[0].removesuffix("_nzcvq")
        ]
    return None


def _data(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name in ("add", "sub") and operands[0] == "sp":
        return (0xB000 | 0x80 * (name == "sub") | _number(operands[-1]) // 4,)
    if name == "tst" and operands[1].startswith("#"):
        return 0xF010 | _register(operands[0]), 0x0F00 | _number(operands[1])
    if name == "lsls":
        to, source = _register(operands[0]), _register(operands[1])
        return (_number(operands[2]) << 6 | source << 3 | to,)
    if name in _DIVIDE:
        to, left, right = map(_register, operands)
        return _DIVIDE[name] | left, 0xF0F0 | to << 8 | right
    return None


def _narrow_data(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name in _IMMEDIATE_8 and operands[-1].startswith("#"):
        return (_IMMEDIATE_8[name] | _register(operands[0]) << 8 | _number(operands[-1]),)
    if name in _THREE_REGISTERS and len(operands) == 3:
        to, left, right = map(_register, operands)
        return (_THREE_REGISTERS[name] | right << 6 | left << 3 | to,)
    if name in _TWO_REGISTERS:
        return (_TWO_REGISTERS[name] | _register(operands[1]) << 3 | _register(operands[0]),)
    return None


def _address(text: str) -> tuple[int, int]:
    """Return base register and offset of ``[r0, #4]``."""
    base, _, offset = text.strip("[]").partition(",")
    return _register(base.strip()), _number(offset.strip()) if offset else 0


def _memory(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name in _MEMORY:
        base, offset = _address(operands[1])
        return _MEMORY[name] | base, _register(operands[0]) << 12 | offset
    if name in _PAIR:
        base, offset = _address(operands[2])
        up = 0x80 if offset >= 0 else 0
        registers = _register(operands[0]) << 12 | _register(operands[1]) << 8
        return _PAIR[name] | up | base, registers | abs(offset) // 4
    if name == "ldrex":
        base, offset = _address(operands[1])
        return 0xE850 | base, _register(operands[0]) << 12 | 0xF00 | offset // 4
    if name == "strex":
        base, offset = _address(operands[2])
        return 0xE840 | base, _register(operands[1]) << 12 | _register(operands[0]) << 8 | offset // 4
    return None


def _multiple(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name in _MULTIPLE:
        return _MULTIPLE[name] | 0x20 * operands[0].endswith("!") | _register(operands[0].rstrip("!")), _mask(
            operands[1]
        )
    if name == "push":
        mask = _mask(operands[0])
        return (0xE92D, mask) if mask & 0xBF00 else (0xB400 | mask & 0xFF | mask >> 14 << 8,)
    if name == "pop":
        mask = _mask(operands[0])
        return (0xE8BD, mask) if mask & 0x7F00 else (0xBC00 | mask & 0xFF | mask >> 15 << 8,)
    return None


def _floating(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name == "vmov":
        to_core = operands[0].startswith("r")
        core, single = (operands if to_core else operands[::-1])[:2]
        number = int(single[1:])
        return 0xEE00 | 0x10 * to_core | number >> 1, _register(core) << 12 | 0xA10 | (number & 1) << 7
    if name == "vadd.f32":
        to, left, right = (int(operand[1:]) for operand in operands)
        first = 0xEE30 | (to & 1) << 6 | left >> 1
        return first, to >> 1 << 12 | 0xA00 | (left & 1) << 7 | (right & 1) << 5 | right >> 1
    if name == "vmrs":
        return 0xEEF1, _register(operands[0]) << 12 | 0xA10
    if name == "vmsr":
        return 0xEEE1, _register(operands[1]) << 12 | 0xA10
    return None


def _floating_memory(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name in ("vldr", "vstr"):
        base, offset = _address(operands[1])
        number = int(operands[0][1:])
        first = (0xED90 if name == "vldr" else 0xED80) | (number & 1) << 6 | base
        return first, number >> 1 << 12 | 0xA00 | offset // 4
    if name in _FLOATING_MULTIPLE:
        numbers = _list(operands[1], "s")
        back = 0x20 * operands[0].endswith("!")
        first = _FLOATING_MULTIPLE[name] | back | (numbers[0] & 1) << 6 | _register(operands[0].rstrip("!"))
        return first, numbers[0] >> 1 << 12 | 0xA00 | len(numbers)
    return None


def _branches(name: str, operands: list[str], place: Place) -> tuple[int, ...] | None:
    if name == "b":
        return (0xE000 | place.distance(operands[0], 11),)
    if name == "bl":
        field = place.distance(operands[0], 24)
        sign = field >> 23 & 1
        j1, j2 = (field >> bit & 1 ^ 1 ^ sign for bit in (22, 21))
        return 0xF000 | sign << 10 | field >> 11 & 0x3FF, 0xD000 | j1 << 13 | j2 << 11 | field & 0x7FF
    if name in _BRANCH_REGISTER:
        return (_BRANCH_REGISTER[name] | _register(operands[0]) << 3,)
    if name in ("cbz", "cbnz"):
        distance = place.distance(operands[1], 7)
        return (
            0xB100
            | 0x800 * (name == "cbnz")
            | distance >> 5 << 9
            | (distance & 0x1F) << 3
            | _register(operands[0]),
        )
    if name[:1] == "b" and name[1:] in CONDITIONS:
        return (0xD000 | CONDITIONS.index(name[1:]) << 8 | place.distance(operands[0], 8),)
    return None


_ENCODERS: tuple[Callable[[str, list[str], Place], tuple[int, ...] | None], ...] = (
    _simple,
    _moves,
    _data,
    _narrow_data,
    _memory,
    _multiple,
    _floating,
    _floating_memory,
    _branches,
)
