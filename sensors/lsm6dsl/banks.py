"""The LSM6DSL's register banks: the main one and the embedded ones A and B (datasheet 9.1; AN5040 2)."""

from __future__ import annotations

from collections.abc import Mapping

from sensors.lsm6dsl import bank_a, bank_b, registers
from sensors.lsm6dsl.registers import FUNC_CFG_ACCESS
from sensors.register import RegisterMap
from sensors.register_file import RegisterFile

MAIN = RegisterMap.of(registers)
EMBEDDED = {"A": RegisterMap.of(bank_a), "B": RegisterMap.of(bank_b)}
_TITLES = {"A": "Embedded bank A, selected by FUNC_CFG_ACCESS = 0x80", "B": "... bank B, by 0xA0"}


def titled_maps() -> dict[str, RegisterMap]:
    """Every map by its title; the main one has none."""
    return {"": MAIN, **{_TITLES[name]: bank for name, bank in EMBEDDED.items()}}


class Banks:
    """``main`` and ``embedded``, the latter by their FUNC_CFG_ACCESS value."""

    def __init__(self, main: RegisterFile) -> None:
        self.main = main
        self.embedded: Mapping[int, RegisterFile] = {
            0x80: RegisterFile(EMBEDDED["A"], version=main.version),
            0xA0: RegisterFile(EMBEDDED["B"], version=main.version),
        }

    def files(self) -> tuple[RegisterFile, ...]:
        """All of them, the main one first."""
        return (self.main, *self.embedded.values())

    def select(self, value: int, now_ps: int) -> RegisterFile:
        """FUNC_CFG_ACCESS has been written: the bank that answers from now on."""
        if value == FUNC_CFG_ACCESS.FUNC_CFG_EN_B.mask:
            self.main.note(now_ps, "forbidden", "FUNC_CFG_ACCESS = 0x20 selects no bank")
        for registers_ in self.files():  # the register is visible in every bank
            registers_.mem[FUNC_CFG_ACCESS.addr] = value
        return self.embedded.get(value, self.main)
