"""What a caller in Python gives to a bus, checked: a mistake is an InputError that names what is right."""

from __future__ import annotations

from emulator.errors import InputError

_LONGEST = 65535  # of one transfer, as HAL's 16-bit length has it


def payload(data: object) -> bytes:
    """The bytes to be sent; not an int, of which ``bytes`` would make as many zeros."""
    if isinstance(data, bytes | bytearray | memoryview):
        return bytes(data)
    if isinstance(data, list | tuple) and all(isinstance(byte, int) and 0 <= byte <= 0xFF for byte in data):
        return bytes(data)
    raise InputError(f"cannot send {data!r}; give bytes, such as b'\\x0f'")


def length(count: object, least: int) -> int:
    """How many bytes to read."""
    if not isinstance(count, int) or not least <= count <= _LONGEST:
        raise InputError(f"cannot read {count!r} bytes in one transfer; give {least} to {_LONGEST}")
    return count


def address(number: object) -> int:
    """A 7-bit I2C address."""
    if not isinstance(number, int):
        raise InputError(f"I2C address {number!r} is no integer; give 0x00 to 0x7F")
    if not 0 <= number <= 0x7F:
        raise InputError(f"I2C address {number:#x} has more than 7 bits; give 0x00 to 0x7F, no R/W bit")
    return number
