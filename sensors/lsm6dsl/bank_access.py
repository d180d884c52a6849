"""Writes to the embedded banks, for the functions that are set up there."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.registers import CTRL1_XL, CTRL2_G
from sensors.register import Register

BANK_A, BANK_B = 0x80, 0xA0  # as selected by FUNC_CFG_ACCESS


def on_bank_write(
    chip: Chip, bank: int, registers: Iterable[type[Register]], changed: Callable[[int], None]
) -> None:
    """Call ``changed(now_ps)`` after any of ``registers`` is written; what came before is done by then.

    Bank A is to be written with both sensors in power-down (AN5040 section 6); a write at another time works
    and is noted. Bank B is not: it is reset each time the accelerometer leaves power-down, so that it has to
    be written afterwards.
    """
    mem = chip.registers.mem

    def hook_for(register: type[Register]) -> Callable[[int, int, int], None]:
        def written(old: int, new: int, now_ps: int) -> None:
            del old, new
            measuring = mem[CTRL1_XL.addr] & CTRL1_XL.ODR_XL.mask or mem[CTRL2_G.addr] & CTRL2_G.ODR_G.mask
            if bank == BANK_A and measuring:
                chip.note(now_ps, "forbidden", f"{register.__name__} written while a sensor is on")
            chip.catch_up(now_ps)
            changed(now_ps)

        return written

    for register in registers:
        chip.banks[bank].on_write(register, hook_for(register))
