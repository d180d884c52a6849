"""Virtual time from retired instructions: time = origin + instructions x cycles per instruction / HCLK,
exactly.

Decision: one number of cycles for every instruction, 1.3 unless set otherwise. The Cortex-M4 executes most
instructions in one cycle; a load takes two unless the next one hides it, a taken branch two to four
(Cortex-M4 technical reference manual, table 3-1), and ST's flash accelerator (ART) makes up for the two
wait states at 84 MHz in all but long jumps (RM0368 section 3.4.2). With a load in every fifth
instruction, half of them hidden, and a taken branch in every tenth, compiled code comes to 1 + 0.1 +
0.2. Dhrystone's published 1.25 DMIPS/MHz, some 450 cycles an iteration of about 340 instructions, says
the same. The road not taken is a model of the pipeline: three times the work at every instruction, for
an accuracy that the ART's undocumented cache would undo.

Exception entry and return cost the cycles of the same manual's section 3.9 (12 in, 10 out, 6 when chained).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Final

from emulator.clock import NEVER_PS, PS_PER_S

CYCLES_PER_INSTRUCTION: Final = Fraction(13, 10)


class Timeline:
    """``count`` instructions have been retired since ``origin_ps``; plain attributes, read at every access.

    The time after ``n`` instructions is ``origin_ps + (n * num + extra) // den`` picoseconds, rounded
    down once.
    """

    def __init__(self, hclk_hz: int, cycles_per_instruction: Fraction = CYCLES_PER_INSTRUCTION) -> None:
        if not 0 < cycles_per_instruction <= 100:
            raise ValueError(f"{cycles_per_instruction} cycles per instruction; give a number from 0 to 100")
        self.cycles_per_instruction = cycles_per_instruction
        self.origin_ps = 0
        self.count = 0
        self.extra = 0
        self._before = 0  # instructions retired before the origin
        self._set(hclk_hz)

    def _set(self, hclk_hz: int) -> None:
        self.num = self.cycles_per_instruction.numerator * PS_PER_S
        self.den = self.cycles_per_instruction.denominator * hclk_hz
        self.cycle = self.cycles_per_instruction.denominator * PS_PER_S

    @property
    def retired(self) -> int:
        """Instructions retired since power-on."""
        return self._before + self.count

    def now_ps(self) -> int:
        """The time when the next instruction begins; between runs."""
        return self.origin_ps + (self.count * self.num + self.extra) // self.den

    def until(self, at_ps: int) -> int:
        """How many more instructions must be retired for the time to be ``at_ps`` or later; at least 0."""
        if at_ps >= NEVER_PS:
            return NEVER_PS
        return max(self.position(at_ps) - self.count, 0)

    def position(self, at_ps: int) -> int:
        """The value of ``count`` from which on the time is ``at_ps`` or later."""
        return -((self.extra - (at_ps - self.origin_ps) * self.den) // self.num)

    def spend(self, cycles: int) -> None:
        """Cycles in which no instruction is retired: exception entry and return."""
        extra = self.extra + cycles * self.cycle
        self.origin_ps += extra // self.den
        self.extra = extra % self.den

    def sleep_until(self, at_ps: int) -> None:
        """The core stands still until ``at_ps``."""
        self._restart(at_ps, 0)

    def set_rate(self, hclk_hz: int, at_ps: int, running: int) -> None:
        """HCLK changes at ``at_ps``, ``running`` instructions into the present run."""
        self._restart(at_ps, running)
        self._set(hclk_hz)

    def _restart(self, at_ps: int, running: int) -> None:
        self._before += self.count + running
        self.origin_ps, self.extra, self.count = at_ps, 0, -running
