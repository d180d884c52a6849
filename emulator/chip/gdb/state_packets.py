"""Packets that look at and change registers and memory ("Packets")."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from emulator.chip.cpu.memory_map import FLASH, FLASH_SIZE
from emulator.chip.gdb import arguments
from emulator.chip.gdb.arguments import MOST_BYTES, MalformedError
from emulator.chip.gdb.description import REGISTERS, Register
from emulator.chip.gdb.replies import OK, REFUSED
from emulator.chip.gdb.target import Target


class StatePackets:
    """Answers those packets for a stopped target, by their first letter. They raise MalformedError."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self.commands: Final[dict[bytes, Callable[[bytes], bytes]]] = {
            b"g": self._read_all,
            b"G": self._write_all,
            b"p": self._read_one,
            b"P": self._write_one,
            b"m": self._read_memory,
            b"M": lambda text: self._write_memory(text, binary=False),
            b"X": lambda text: self._write_memory(text, binary=True),
        }

    def _read_all(self, text: bytes) -> bytes:
        del text
        values = self._target.read_registers()
        return b"".join(_to_hex(register, values) for register in REGISTERS)

    def _write_all(self, text: bytes) -> bytes:
        data = arguments.from_hex(text)
        if len(data) != sum(register.size for register in REGISTERS):
            raise MalformedError
        at = 0
        for register in REGISTERS:
            self._write(register, int.from_bytes(data[at : at + register.size], "little"))
            at += register.size
        return OK

    def _read_one(self, text: bytes) -> bytes:
        return _to_hex(_register(text), self._target.read_registers())

    def _write_one(self, text: bytes) -> bytes:
        which, _, value = text.partition(b"=")
        register = _register(which)
        self._write(register, arguments.word(value, register.size))
        return OK

    def _write(self, register: Register, value: int) -> None:
        for part in register.parts:
            self._target.write_register(part, value & 0xFFFF_FFFF)
            value >>= 32

    def _read_memory(self, text: bytes) -> bytes:
        address, length = arguments.pair(text)
        data = self._target.read_memory(address, min(length, MOST_BYTES))
        return data.hex().encode("ascii") if data or not length else REFUSED

    def _write_memory(self, text: bytes, binary: bool) -> bytes:
        address, data = arguments.data_at(text, binary)
        return OK if not data or self._target.write_memory(address, data) else REFUSED

    def flash(self, text: bytes) -> bytes:
        """The packets that GDB's ``load`` writes the flash with, without the "v"; b"" for all others.

        The sectors that it erases are those of the memory map.
        """
        name, _, rest = text.partition(b":")
        if name == b"FlashErase":
            address, length = arguments.pair(rest)
            return self._program(address, b"\xff" * length) if length <= FLASH_SIZE else REFUSED
        if name == b"FlashWrite":
            place, _, data = rest.partition(b":")
            return self._program(arguments.number(place), data)
        return OK if text == b"FlashDone" else b""

    def _program(self, address: int, data: bytes) -> bytes:
        in_flash = address >= FLASH and address + len(data) <= FLASH + FLASH_SIZE
        return OK if in_flash and self._target.write_memory(address, data) else REFUSED


def _register(text: bytes) -> Register:
    number = arguments.number(text)
    if number >= len(REGISTERS):
        raise MalformedError
    return REGISTERS[number]


def _to_hex(register: Register, values: dict[str, int]) -> bytes:
    return b"".join(values[part].to_bytes(4, "little") for part in register.parts).hex().encode("ascii")
