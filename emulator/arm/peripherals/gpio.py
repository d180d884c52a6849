"""GPIO ports A to E and H (RM0368 section 8): modes, latches, inputs, the lock.

The pins themselves, and who else drives them, are :mod:`emulator.gpio`. A pin in alternate-function mode is
let go of: what USART, SPI, I2C and the timers do is modelled as whole bytes, transfers and duty cycles, not
as levels on pins.

Reset values: PA13 to PA15, PB3 and PB4 are the debug port's (AF0), so MODER is 0xA800 0000 for port A.
RM0368 prints 0x0C00 0000 there in some revisions, which would make PA13 analog and contradicts its section
8.3.1. Output speed is stored and has no effect. An analog pin's input stage is off: IDR reads 0 (8.3.12);
EXTI is not cut off from an analog pin here.
"""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.soc import Soc
from emulator.clock import NEVER_PS

MODER, OTYPER, OSPEEDR, PUPDR = 0x00, 0x04, 0x08, 0x0C
IDR, ODR, BSRR, LCKR, AFRL, AFRH = 0x10, 0x14, 0x18, 0x1C, 0x20, 0x24

_OUTPUT, _ALTERNATE, _ANALOG = 1, 2, 3
_BITS_PER_PIN = {MODER: 2, OTYPER: 1, OSPEEDR: 2, PUPDR: 2, AFRL: 4, AFRH: 4}
_RESET = {  # MODER, OSPEEDR, PUPDR
    "A": (0xA800_0000, 0x0C00_0000, 0x6400_0000),
    "B": (0x0000_0280, 0x0000_00C0, 0x0000_0100),
}
_PULL = (None, 1, 0, None)
_LCKK = 1 << 16
_PINS = 0xFFFF


class GpioPort(Peripheral):
    """One port. ``name`` is "GPIOA" to "GPIOE" or "GPIOH"."""

    NAMES: ClassVar[dict[int, str]] = {
        MODER: "MODER",
        OTYPER: "OTYPER",
        OSPEEDR: "OSPEEDR",
        PUPDR: "PUPDR",
        IDR: "IDR",
        ODR: "ODR",
        BSRR: "BSRR",
        LCKR: "LCKR",
        AFRL: "AFRL",
        AFRH: "AFRH",
    }

    def __init__(self, soc: Soc, name: str, base: int, size: int = 0x400) -> None:
        super().__init__(soc, name, base, size)
        self.port = name[-1]
        self._locked = 0
        self._lock_step = 0
        self._lock_pins = 0
        self._inputs = 0  # what the pins read, analog ones included
        self._digital = _PINS  # which are not analog
        self.looks = 0
        """Reads of a register since the last write to one."""
        self.image = memoryview(bytearray(size)).cast("I")
        """The registers as words, for reads straight from memory; IDR is always up to date."""
        for pin in range(16):
            soc.gpio.listen(self.port, pin, partial(self._input_changed, pin))
        self.reset()

    def reset(self) -> None:
        """All pins inputs, but for the debug port's."""
        moder, ospeedr, pupdr = _RESET.get(self.port, (0, 0, 0))
        self.registers = dict.fromkeys(self.NAMES, 0)
        self.registers |= {MODER: moder, OSPEEDR: ospeedr, PUPDR: pupdr}
        self._locked = self._lock_step = self._lock_pins = 0
        self._apply(_PINS)

    def look(self, offset: int) -> tuple[int, int]:
        """Nothing changes but by events and writes."""
        self.looks += 1
        return self.registers.get(offset, 0), NEVER_PS

    def draw(self) -> None:
        """Make ``image`` anew."""
        for offset, value in self.registers.items():
            self.image[offset >> 2] = value if self.clocked else 0

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register; BSRR and ODR move pins, MODER to AFRH set them up."""
        self.looks = 0
        value &= mask
        if offset in {BSRR, ODR}:
            self._latch(self._latched(offset, value, mask))
        elif offset == LCKR:
            self._write_lock(value, mask)
        elif offset in _BITS_PER_PIN:
            self._configure(offset, value, mask)

    def changes_nothing(self, offset: int, value: int, mask: int) -> bool:
        """Loops that show a state write the same to BSRR all the time."""
        return offset in {BSRR, ODR} and self._latched(offset, value & mask, mask) == self.registers[ODR]

    # -- outputs ----------------------------------------------------------------------------------------

    def _latched(self, offset: int, value: int, mask: int) -> int:
        """ODR after a write to ODR or BSRR; set wins when both bits of a pin are written (8.4.7)."""
        if offset == BSRR:
            return self.registers[ODR] & ~(value >> 16) | value & _PINS
        return self.registers[ODR] & ~mask | value & _PINS

    def _latch(self, odr: int) -> None:
        changed = self.registers[ODR] ^ odr
        self.registers[ODR] = odr
        moder = self.registers[MODER]
        while changed:
            pin = (changed & -changed).bit_length() - 1
            changed &= changed - 1
            if moder >> 2 * pin & 3 == _OUTPUT:
                self._output(pin)

    def _output(self, pin: int) -> None:
        open_drain = bool(self.registers[OTYPER] >> pin & 1)
        self.soc.gpio.write(self.port, pin, self.registers[ODR] >> pin & 1, open_drain=open_drain)

    # -- inputs -----------------------------------------------------------------------------------------

    def _input_changed(self, pin: int, level: int) -> None:
        self._inputs = self._inputs & ~(1 << pin) | level << pin
        self.registers[IDR] = self._inputs & self._digital
        if self.clocked:
            self.image[IDR >> 2] = self.registers[IDR]

    # -- set-up -----------------------------------------------------------------------------------------

    def _configure(self, offset: int, value: int, mask: int) -> None:
        width = _BITS_PER_PIN[offset]
        first = 8 if offset == AFRH else 0
        if self._locked:
            for pin in _pins(self._locked):
                if pin >= first:
                    mask &= ~((1 << width) - 1 << width * (pin - first))
        old = self.registers[offset]
        new = old & ~mask | value & mask & (_PINS if width == 1 else WORD)
        self.registers[offset] = new
        changed = old ^ new
        count = 32 // width if width > 1 else 16
        pins = (pin for pin in range(count) if changed >> width * pin & (1 << width) - 1)
        self._apply(sum(1 << first + pin for pin in pins))

    def _apply(self, pins: int) -> None:
        """Set up the pins of a bit set as the registers say."""
        gpio, port = self.soc.gpio, self.port
        for pin in _pins(pins):
            mode = self.registers[MODER] >> 2 * pin & 3
            gpio.set_pull(port, pin, None if mode == _ANALOG else _PULL[self.registers[PUPDR] >> 2 * pin & 3])
            gpio.set_alternate(port, pin, self._function(pin) if mode == _ALTERNATE else None)
            if mode == _OUTPUT:
                self._output(pin)
            else:
                gpio.release(port, pin)
            digital = self._digital & ~(1 << pin)
            self._digital = digital if mode == _ANALOG else digital | 1 << pin
        self.registers[IDR] = self._inputs & self._digital

    def _function(self, pin: int) -> int:
        return self.registers[AFRH if pin >= 8 else AFRL] >> 4 * (pin & 7) & 0xF

    def _write_lock(self, value: int, mask: int) -> None:
        """The sequence 1, 0, 1 of LCKK with the same pins, as whole words, locks them until reset (8.4.8)."""
        if self._locked or mask != WORD:
            return
        key, pins = bool(value & _LCKK), value & _PINS
        wanted = (True, False, True)[self._lock_step]
        if key is not wanted or (self._lock_step and pins != self._lock_pins):
            self._lock_step = 0
            wanted = True
        if key is wanted:
            self._lock_pins = pins
            self._lock_step += 1
        self.registers[LCKR] = self._lock_pins
        if self._lock_step == 3:
            self._locked = pins
            self.registers[LCKR] = pins | _LCKK
            self._lock_step = 0


def _pins(pins: int) -> list[int]:
    return [pin for pin in range(16) if pins >> pin & 1]
