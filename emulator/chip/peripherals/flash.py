"""FLASH interface: erasing, programming, unlocking, wait states (RM0368 section 3).

Operations take the datasheet's typical times (STM32F401xB/C, flash memory characteristics) and
change the memory when they start. Without PG, or with a size other than PSIZE, a store changes
nothing and sets PGSERR or PGPERR. Wait states take no time, but a note reports too few wait states
(table 5, 2.7 to 3.6 V).

NOT MODELLED: instruction fetches do not wait for BSY. Option bytes are fixed: no sector is
protected.
"""

from __future__ import annotations

from collections.abc import Callable

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, InterruptInput, Peripheral, Soc
from fcu_emulator.emulator.chip.registers import DECLARED, flash
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US, Event

ACR, KEYR, OPTKEYR, SR, CR, OPTCR = offsets(
    flash.ACR, flash.KEYR, flash.OPTKEYR, flash.SR, flash.CR, flash.OPTCR
)

_UNLOCK = (0x4567_0123, 0xCDEF_89AB)
_PG, _SER, _MER, _STRT = masks(flash.CR.PG, flash.CR.SER, flash.CR.MER, flash.CR.STRT)
_ERRIE, _EOPIE, _LOCK = masks(flash.CR.ERRIE, flash.CR.EOPIE, flash.CR.LOCK)
_BSY, _OPERR, _EOP = masks(flash.SR.BSY, flash.SR.OPERR, flash.SR.EOP)
_PGSERR, _PGPERR = masks(flash.SR.PGSERR, flash.SR.PGPERR)

_KB = 1024
SECTORS = (
    *(range(n * 16 * _KB, (n + 1) * 16 * _KB) for n in range(4)),
    range(64 * _KB, 128 * _KB),
    range(128 * _KB, 256 * _KB),
)
"""The offsets of the sectors (table 5 of the STM32F401xC)."""
_PROGRAM_PS = 16 * PS_PER_US
_ERASE_MS = {16 * _KB: (400, 300, 250), 64 * _KB: (1200, 700, 550), 128 * _KB: (2000, 1300, 1000)}
"""Typical times by size of the sector and PSIZE (8, 16, 32 bits)."""
_ERASE_ALL_MS = (4000, 2750, 2000)
_HZ_PER_WAIT_STATE = 30_000_000
_CHECK_AFTER_PS = PS_PER_MS
"""Wait states are checked after this time, because firmware may set latency and clock in any order."""


def _bits(control: int) -> str:
    return f"{8 << flash.CR.PSIZE.get(control)} bits"


class Flash(Peripheral, declared=DECLARED["FLASH"]):
    """The registers of the interface. The core contains the memory."""

    def __init__(self, soc: Soc, name: str, base: int, irq: InterruptInput) -> None:
        super().__init__(soc, name, base)
        self._irq = irq
        self._key_step = 0
        self._key_refused = False
        self._check: Event | None = None
        self._operation: Event | None = None
        self._until_ps = 0
        self._memory = memoryview(bytearray(0))
        soc.clocks.on_change(self._check_later)

    def connect(
        self, memory: memoryview[int], programmed: Callable[[int, int], None], erased: Callable[[], None]
    ) -> None:
        """Set the memory. Each later change calls ``programmed(offset, size)`` or ``erased()``."""
        self._memory, self._programmed, self._erased = memory, programmed, erased

    def reset(self) -> None:
        if self._operation is not None:
            self._operation.cancel()
            self._operation = None
        super().reset()
        self._key_step, self._key_refused = 0, False
        self._signal()

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        if offset == KEYR:
            self._unlock(value & mask)
        elif offset == SR:
            self.registers[SR] &= ~(value & mask & ~_BSY)
            self._signal()
        elif offset == CR:
            self._control(value & mask, mask)
        elif offset in {OPTKEYR, OPTCR}:
            self.note("not modelled", "option-bytes", "option bytes are fixed")
        else:
            super().write(offset, value, mask)
            self._check_later()

    def _unlock(self, key: int) -> None:
        """Unlock CR after two keys. A wrong key locks CR until reset (3.6.1)."""
        if self._key_refused:
            return
        if key != _UNLOCK[self._key_step]:
            self._key_refused = True
            self.note("refused", "wrong-key", "KEYR: wrong key; FLASH_CR stays locked until reset")
            return
        self._key_step += 1
        if self._key_step == len(_UNLOCK):
            self._key_step = 0
            self.registers[CR] &= ~_LOCK

    def _control(self, value: int, mask: int) -> None:
        if self.registers[CR] & _LOCK:
            self.note("refused", "locked", "CR written while it is locked; write the two keys to KEYR first")
            return
        super().write(CR, value, mask)
        if value & _LOCK:
            self.registers[CR] |= _LOCK
        if value & _STRT:
            self._erase()
        self._signal()

    def _signal(self) -> None:
        control, status = self.registers[CR], self.registers[SR]
        active = (control & _ERRIE and status & _OPERR) or (control & _EOPIE and status & _EOP)
        self._irq.set(self.name, bool(active))

    # -- operations (3.6) -------------------------------------------------------------------------------

    def store(self, offset: int, size: int, value: int) -> bool:
        """Program bits from 1 to 0. Return False if the store is refused (3.6.3)."""
        control = self.registers[CR]
        errors = 0 if control & _PG else _PGSERR
        if size != 1 << flash.CR.PSIZE.get(control):
            errors |= _PGPERR
        if errors:
            self._fail(
                errors,
                "store-refused",
                f"a store to the flash while PG in CR is {control & _PG} and PSIZE {_bits(control)}",
            )
            return False
        content = self._memory[offset : offset + size]
        content[:] = (int.from_bytes(content, "little") & value).to_bytes(size, "little")
        self._programmed(offset, size)
        self._begin(_PROGRAM_PS)
        return True

    def _erase(self) -> None:
        control = self.registers[CR]
        sector, parallelism = flash.CR.SNB.get(control), min(flash.CR.PSIZE.get(control), 2)
        if control & _SER and not control & _MER and sector < len(SECTORS):
            erased = SECTORS[sector]
            duration_ms = _ERASE_MS[len(erased)][parallelism]
        elif control & _MER and not control & _SER:
            erased, duration_ms = range(len(self._memory)), _ERASE_ALL_MS[parallelism]
        else:
            self.registers[CR] &= ~_STRT
            self._fail(
                _PGSERR,
                "nothing-to-erase",
                f"CR.STRT with SER, MER and SNB = 0x{control & 0x7E:02X}, which selects nothing to erase",
            )
            return
        self._memory[erased.start : erased.stop] = b"\xff" * len(erased)
        self._erased()
        self.registers[CR] |= _STRT
        self._begin(duration_ms * PS_PER_MS)

    def _begin(self, duration_ps: int) -> None:
        """Set BSY. If another operation is running, the new operation begins after its end (3.6.1)."""
        begin_ps = self.soc.clock.now_ps
        if self._operation is not None:
            begin_ps = self._until_ps
            self._operation.cancel()
        self.registers[SR] |= _BSY
        self._until_ps = begin_ps + duration_ps
        self._operation = self.soc.clock.schedule(self._until_ps, self._end)

    def _end(self) -> None:
        self._operation = None
        self.registers[SR] &= ~_BSY
        self.registers[CR] &= ~_STRT
        if self.registers[CR] & _EOPIE:
            self.registers[SR] |= _EOP
        self._signal()

    def _fail(self, errors: int, problem: str, text: str) -> None:
        self.note("refused", problem, text, errors=errors)
        self.registers[SR] |= errors
        if self.registers[CR] & _ERRIE:
            self.registers[SR] |= _OPERR  # set only if the error interrupt is enabled (3.8.4)
        self._signal()

    # -- wait states ------------------------------------------------------------------------------------

    def _check_later(self) -> None:
        if self._check is None and self._missing_wait_states():
            self._check = self.soc.clock.schedule(self.soc.clock.now_ps + _CHECK_AFTER_PS, self._check_limits)

    def _check_limits(self) -> None:
        self._check = None
        needed = self._missing_wait_states()
        if needed:
            hclk_mhz = self.soc.clocks.nominal_hclk_hz / 1e6
            setting = f"ACR.LATENCY = {self.registers[ACR] & 0xF} at HCLK = {hclk_mhz:g} MHz"
            self.note(
                "forbidden",
                "wait-states",
                f"{setting}; the flash needs {needed} wait states",
                latency=self.registers[ACR] & 0xF,
                needed=needed,
                hclk_mhz=hclk_mhz,
            )

    def _missing_wait_states(self) -> int:
        needed = max(-(-self.soc.clocks.nominal_hclk_hz // _HZ_PER_WAIT_STATE) - 1, 0)
        return needed if needed > self.registers[ACR] & 0xF else 0
