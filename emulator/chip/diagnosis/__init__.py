"""Diagnosis of faulty firmware, in words that students know.

::

    board = Board(firmware="lab3.elf")
    board.run_for(3)
    print(board.chip.diagnosis() or "all is well")

Decision: a diagnosis is computed once, at the end of a run, from the state of the chip. Sampling
the program counter would slow down correct runs and prove nothing. Endless loops are proved by
execution in a copy of core and memory.
"""

from fcu_emulator.emulator.chip.diagnosis.diagnose import diagnose, findings
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis

__all__ = ["Diagnosis", "diagnose", "findings"]
