"""The Cortex-M4 put together: engine, time, exceptions, system control space, and the bus to the blocks.

::

    soc.irq, soc.memory = core.nvic, core.bus      # what blocks need of the core
    core.start("power-on")
    core.run_until(1_000_000_000)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction

from emulator.arm.cpu import engines
from emulator.arm.cpu import scb as scb_registers
from emulator.arm.cpu.bus import Bus
from emulator.arm.cpu.cycle_counter import Dwt
from emulator.arm.cpu.engine import FLASH, FLASH_SIZE, RAM
from emulator.arm.cpu.exceptions import Exceptions
from emulator.arm.cpu.idle_loops import IdleLoops
from emulator.arm.cpu.machine import Machine
from emulator.arm.cpu.native_bus import NativeBus
from emulator.arm.cpu.native_engine import NativeEngine
from emulator.arm.cpu.native_exceptions import NativeExceptions, NativeNvic, nvic_of
from emulator.arm.cpu.nvic import Nvic
from emulator.arm.cpu.registers import EVERYTHING, Registers
from emulator.arm.cpu.scb import Scb
from emulator.arm.cpu.slice import Slice
from emulator.arm.cpu.special import Special, SpecialInstructions
from emulator.arm.cpu.system_space import SystemControlSpace
from emulator.arm.cpu.systick import SysTick
from emulator.arm.cpu.timeline import CYCLES_PER_INSTRUCTION, Timeline
from emulator.arm.cpu.waiting import Waiting
from emulator.arm.peripherals.peripheral import Peripheral
from emulator.arm.soc import Soc

_THUMB = 1 << 24
_FPU_ACCESS = 0x00F0_0000
_NO_RETURN = 0xFFFF_FFFF


@dataclass(frozen=True)
class CoreSettings:
    """``skip``: whether waiting loops are skipped, which changes only the speed. ``alignment``: whether LDM,
    LDRD, VLDR and their kin fault at an unaligned address, as on the chip, which takes a microsecond of the
    host's time for every load and store. ``engine``: "native" or "unicorn"; "" is the native one where it was
    built. ``native_counter`` False has Unicorn count instructions by a hook, which is slow and for builds of
    it whose counter cannot be found.
    """

    cycles_per_instruction: Fraction = CYCLES_PER_INSTRUCTION
    skip: bool = True
    native_counter: bool = True
    alignment: bool = False
    engine: str = ""


class Core:
    """``segments``: the firmware's bytes by address, in flash or RAM. ``blocks``: all peripherals that
    are built. Raises ValueError for bytes that are elsewhere.

    ``soc.clocks`` must be set; ``soc.irq`` and ``soc.memory`` are set here. ``on_reset(reason)`` is
    called at each reset but power-on, before the blocks are reset.
    """

    def __init__(
        self,
        soc: Soc,
        segments: Iterable[tuple[int, bytes]],
        blocks: Iterable[Peripheral],
        settings: CoreSettings = CoreSettings(),
        system_memory: Iterable[tuple[int, bytes]] = (),
        on_reset: Callable[[str], None] | None = None,
    ) -> None:
        self._soc = soc
        self._on_reset = on_reset
        self.blocks = tuple(blocks)
        self.engine = engines.make(settings.engine, system_memory, settings.native_counter)
        self._load(segments)
        self.native = NativeBus(self.engine) if isinstance(self.engine, NativeEngine) else None
        """Where the native engine sees time, waiting and exceptions; None if another one is used."""
        self._put_together(settings)
        soc.irq = self.nvic
        run = self.run
        self.systick = SysTick(soc, self.nvic)
        self.dwt = Dwt(soc)
        self.space = SystemControlSpace(soc, self.nvic, self.scb, self.systick)
        self.bus = Bus(soc, run, self.waiting, (*self.blocks, self.space, self.dwt))
        soc.memory = self.bus
        soc.clocks.on_change(lambda: run.set_rate(soc.clocks.hclk_hz))
        self.special = SpecialInstructions(self.engine)
        self.special.switch(Special.WORDS, settings.alignment)
        idle = IdleLoops(run, self.waiting, settings.skip)
        images = self.bus.images
        self.machine = Machine(
            run, self.exceptions, self.waiting, idle, self.special, images, soc.trace, self.start
        )
        if self.native is not None:
            self.native.fire_by(self.machine.fire)
        self._everything = Registers(self.engine, EVERYTHING)
        self.before_reset = b"", b""
        """R0 to R12, SP, LR, PC, xPSR, and the RAM, where the latest reset has met the program."""
        self.start("")

    def _put_together(self, settings: CoreSettings) -> None:
        clock, clocks = self._soc.clock, self._soc.clocks
        rate = clocks.hclk_hz, settings.cycles_per_instruction
        parts = self.request_reset, self._handled, self._switched
        self.timeline: Timeline
        self.nvic: Nvic
        self.run: Slice
        self.waiting: Waiting
        self.exceptions: Exceptions
        if self.native is None:
            self.timeline, self.nvic = Timeline(*rate), Nvic()
            self.run = Slice(self.engine, self.timeline, clock, self.nvic)
            self.waiting = Waiting(self.run, settings.skip)
            self.scb = Scb(self.nvic, *parts)
            self.exceptions = Exceptions(self.engine, self.timeline, self.nvic, self.scb)
        else:
            self.timeline, self.nvic = self.native.timeline(*rate), nvic_of(self.native)
            self.run = self.native.slice(self.timeline, clock, self.nvic)
            self.waiting = self.native.waiting(self.run, settings.skip)
            self.scb = Scb(self.nvic, *parts)
            self.exceptions = NativeExceptions(self.native, self.timeline, self.nvic, self.scb)

    def _load(self, segments: Iterable[tuple[int, bytes]]) -> None:
        for address, data in segments:
            memory = self.engine.memory(address, len(data))
            if memory is None or not (FLASH <= address < FLASH + FLASH_SIZE or address >= RAM):
                raise ValueError(f"{len(data)} bytes at 0x{address:08X} are neither in flash nor in RAM")
            memory[:] = data

    def run_until(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        self.machine.run_until(at_ps)

    def request_reset(self, reason: str) -> None:
        """Reset the chip; virtual time goes on."""
        self.machine.request_reset(reason)

    def code_changed(self) -> None:
        """The flash has another content: forget what is known of the code; between runs."""
        self.engine.forget_code()
        self.special.search_again()

    def start(self, reason: str) -> None:
        """The state after reset (ARMv7-M ARM B1.5.5): registers, blocks, SP and PC from the vector table.

        RAM keeps what it has.
        """
        if reason:
            self.before_reset = self.engine.state_at(self.engine.pc), bytes(self.engine.ram)
            if self._on_reset is not None:
                self._on_reset(reason)
            for block in reversed(self.blocks):  # RCC last: no block sees new clocks with old settings
                block.reset()
        self.nvic.reset()
        self.scb.reset()
        self.systick.reset()
        self.dwt.reset()
        self.exceptions.reset()
        names = self._everything.names
        values = dict.fromkeys(names, 0)
        stack, vector = (int.from_bytes(self.engine.flash[at : at + 4], "little") for at in (0, 4))
        values |= {"xpsr": _THUMB, "msp": stack & ~3, "sp": stack & ~3, "lr": _NO_RETURN}
        self._everything.write(*(values[name] for name in names))
        self.engine.pc, self.engine.thumb = vector & ~1, bool(vector & 1)

    def _handled(self) -> int:
        return self.exceptions.frames.handled()

    def _switched(self, register: int, value: int) -> None:
        """A register that acts outside of the system control block has been written."""
        if isinstance(self.nvic, NativeNvic):
            self.nvic.configured(register, value)
        if register == scb_registers.CPACR:
            self.special.switch(Special.FLOATING_POINT, value & _FPU_ACCESS != _FPU_ACCESS)
        elif register == scb_registers.CCR:
            self.special.switch(Special.DIVIDES, bool(value & scb_registers.DIV_0_TRP))
            self.special.switch(Special.ACCESS, bool(value & scb_registers.UNALIGN_TRP))
        elif register == scb_registers.DEMCR:
            self.dwt.enable(value)
