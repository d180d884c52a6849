"""A core with a program and one peripheral for tests of the core, with a clock that makes times easy to read.

By default HCLK is 1 MHz and an instruction takes one cycle, so the n-th instruction begins n microseconds
after reset (plus the times of exception entry and return). Programs are written for
:mod:`tests.support.arm.thumb_assembler`. Labels that are names of exceptions become vectors::

    bench = CoreBench('''
    reset:   log 1
             svc #0
             log 3
             b .
    svc:     log 2
             bx lr
    ''')
    bench.run_us(100)
    assert bench.values == [1, 2, 3]

``log n`` writes a number and ``log rN`` a register to the :class:`Probe`, which notes value and time. ``log``
changes R12 and, for a number, R3; exceptions save both. It takes three or four instructions.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import ClassVar

from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.chip.cpu.core import Core, CoreSettings
from fcu_emulator.emulator.chip.cpu.core_registers import FLOATING_POINT, CoreRegisters
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM, RAM_SIZE
from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral, Soc
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_US, Clock
from fcu_emulator.emulator.trace import Fault, Trace
from tests.support.arm.chip_fakes import FakeClockTree
from tests.support.arm.thumb_assembler import assemble

ENTRY_CYCLES, RETURN_CYCLES, CHAIN_CYCLES = 12, 10, 6
"""Cortex-M4 technical reference manual, section 3.9."""
STACK = RAM + RAM_SIZE
PROBE = 0x4000_1800
"""An address without a peripheral of the chip (RM0368 table 1)."""
CODE = FLASH + 0x200

_EXCEPTIONS = {
    "reset": 1,
    "nmi": 2,
    "hard_fault": 3,
    "mem_manage": 4,
    "bus_fault": 5,
    "usage_fault": 6,
    "svc": 11,
    "pend_sv": 14,
    "sys_tick": 15,
    **{f"irq{number}": 16 + number for number in range(85)},
}
_UNEXPECTED = """
unexpected:
    mrs r3, ipsr
    movt r3, #0xBAD
    log r3
    b .
"""

SYMBOLS = {
    "LOG": PROBE,
    "FLAG": PROBE + 4,
    "EFFECT": PROBE + 8,
    "LOWER": PROBE + 12,
    "RATE": PROBE + 16,
    "RAM": RAM,
    "STACK": STACK,
    "ICSR": 0xE000_ED04,
    "VTOR": 0xE000_ED08,
    "AIRCR": 0xE000_ED0C,
    "SCR": 0xE000_ED10,
    "CCR": 0xE000_ED14,
    "SHPR1": 0xE000_ED18,
    "SHPR2": 0xE000_ED1C,
    "SHPR3": 0xE000_ED20,
    "SHCSR": 0xE000_ED24,
    "CFSR": 0xE000_ED28,
    "HFSR": 0xE000_ED2C,
    "BFAR": 0xE000_ED38,
    "CPACR": 0xE000_ED88,
    "DEMCR": 0xE000_EDFC,
    "FPCCR": 0xE000_EF34,
    "FPCAR": 0xE000_EF38,
    "ISER": 0xE000_E100,
    "ICER": 0xE000_E180,
    "ISPR": 0xE000_E200,
    "ICPR": 0xE000_E280,
    "IABR": 0xE000_E300,
    "IPR": 0xE000_E400,
    "STIR": 0xE000_EF00,
    "SYST_CSR": 0xE000_E010,
    "SYST_RVR": 0xE000_E014,
    "SYST_CVR": 0xE000_E018,
    "DWT_CTRL": 0xE000_1000,
    "CYCCNT": 0xE000_1004,
}
"""Names that programs can use."""


class Probe(Peripheral):
    """Device that notes each write to LOG. FLAG reads as 1 from ``flag_ps`` on. EFFECT counts its reads.

    Writing n to LOWER makes interrupt line n inactive; RATE sets HCLK in kHz.
    """

    REGISTERS: ClassVar[dict[int, int]] = dict.fromkeys(range(0, 20, 4), 0)
    NAMES: ClassVar[dict[int, str]] = {0: "LOG", 4: "FLAG", 8: "EFFECT", 12: "LOWER", 16: "RATE"}

    def __init__(self, soc: Soc, clocks: FakeClockTree) -> None:
        super().__init__(soc, "probe", PROBE)
        self._clocks = clocks
        self.log: list[tuple[int, int]] = []
        self.writes: list[tuple[int, int, int]] = []
        self.flag_ps = NEVER_PS

    def reset(self) -> None:
        """Keep the notes over a system reset."""

    def read(self, offset: int) -> int:
        if offset == 4:
            return int(self.soc.clock.now_ps >= self.flag_ps)
        if offset == 8:
            self.registers[8] += 1
        return super().read(offset)

    def write(self, offset: int, value: int, mask: int = 0xFFFF_FFFF) -> None:
        self.writes.append((offset, value, mask))
        if offset == 0:
            self.log.append((self.soc.clock.now_ps, value & mask))
        elif offset == 12:
            self.soc.irq.set_line(value, False)
        elif offset == 16:
            self._clocks.set(hclk_hz=1000 * value)

    def pure_read(self, offset: int) -> bool:
        return offset != 8

    def next_change_ps(self) -> int:
        return self.flag_ps if self.soc.clock.now_ps < self.flag_ps else NEVER_PS


class CoreBench:
    """A core before the first instruction of ``program``."""

    def __init__(
        self,
        program: str,
        *,
        hclk_hz: int = 1_000_000,
        cycles: Fraction = Fraction(1),
        skip: bool = True,
        stack: int = STACK,
        vectors: dict[str, int] | None = None,
        more: Iterable[tuple[int, bytes]] = (),
    ) -> None:
        self.clock = Clock()
        self.trace = Trace()
        self.clocks = FakeClockTree()
        self.clocks.set(hclk_hz=hclk_hz)
        soc = Soc(self.clock, self.trace, Gpio(self.clock, self.trace), self._reset)
        soc.clocks = self.clocks
        self.probe = Probe(soc, self.clocks)
        code, self.labels = assemble(_expand(program + _UNEXPECTED), CODE, SYMBOLS)
        table = [stack] + [self.labels["unexpected"] | 1] * 101
        for name, number in _EXCEPTIONS.items():
            if name in self.labels:
                table[number] = self.labels[name] | 1
        for name, value in (vectors or {}).items():
            table[_EXCEPTIONS[name]] = value
        segments = [(FLASH, struct.pack("<102I", *table)), (CODE, code), *more]
        self.core = Core(self.clock, self.trace, segments, CoreSettings(cycles, skip))
        self.core.power_on(soc, [self.probe])

    def _reset(self, reason: str) -> None:
        self.core.request_reset(reason)

    # -- time -------------------------------------------------------------------------------------------

    def run_us(self, until_us: float) -> None:
        """Run up to this time since the start."""
        self.core.run_until_ps(round(until_us * PS_PER_US))

    def at_us(self, time_us: float, action: Callable[[], None]) -> None:
        """Call ``action()`` at this time in microseconds."""
        self.clock.schedule(round(time_us * PS_PER_US), action)

    def pulse_at_us(self, time_us: float, number: int) -> None:
        """A short pulse on interrupt line ``number``."""
        self.at_us(time_us, lambda: self.pulse(number))

    def line_at_us(self, time_us: float, number: int, level: bool) -> None:
        """Make interrupt line ``number`` active or inactive from this time on."""
        self.at_us(time_us, lambda: self.core.set_line(number, level))

    def pulse(self, number: int) -> None:
        """Pulse interrupt line ``number`` now."""
        self.core.set_line(number, True)
        self.core.set_line(number, False)

    # -- what was seen ----------------------------------------------------------------------------------

    @property
    def values(self) -> list[int]:
        """Return the values that were written to LOG."""
        return [value for _, value in self.probe.log]

    @property
    def log_us(self) -> list[tuple[float, int]]:
        """Return (time in microseconds, value) of every write to LOG."""
        return [(at_ps / PS_PER_US, value) for at_ps, value in self.probe.log]

    def register(self, number: int) -> int:
        """Return one of R0 to R15, or xPSR for 16."""
        return self.core.register(number)

    def time_us(self, value: int) -> float:
        """Return the only time at which ``value`` was logged."""
        (time_us,) = (at for at, logged in self.log_us if logged == value)
        return time_us

    def floating_point(self) -> list[int]:
        """Return S0 to S31 and FPSCR."""
        return list(CoreRegisters(self.core, FLOATING_POINT).read())

    def word(self, address: int) -> int:
        """Return a word of RAM."""
        return int.from_bytes(self.core.ram[address - RAM : address - RAM + 4], "little")

    def system(self, name: str) -> int:
        """Return a register of the system control space, by its name in SYMBOLS."""
        value = self.core.peek(SYMBOLS[name])
        assert value is not None
        return value

    def faults(self) -> list[str]:
        """Return the trace's notes about faults of the core."""
        return [event.text for event in self.trace.of(Fault) if event.where == "core"]


def _expand(program: str) -> str:
    """Return the instructions of a ``log``."""

    def write(match: re.Match[str]) -> str:
        value = match[2]
        if value.startswith("r"):
            return f"{match[1]} mov32 r12, LOG\n str {value}, [r12]\n"
        return f"{match[1]} movw r3, #{value}\n mov32 r12, LOG\n str r3, [r12]\n"

    return re.sub(r"^(\s*(?:\w+:)?)\s*log (\w+)", write, program, flags=re.MULTILINE)


def interrupts(priorities: dict[int, int]) -> str:
    """Return instructions that give interrupt inputs these priorities and enable them."""
    lines = []
    for number, priority in priorities.items():
        lines += [f"mov32 r0, IPR+{number}", f"movs r1, #{priority}", "strb r1, [r0]"]
    for number in priorities:
        lines += [f"mov32 r0, ISER+{4 * (number // 32)}", f"mov32 r1, {1 << number % 32}", "str r1, [r0]"]
    return "\n".join(lines) + "\n"


def store(name: str, value: int) -> str:
    """Return five instructions that write a word."""
    return f"mov32 r0, {name}\nmov32 r1, {value}\nstr r1, [r0]\n"
