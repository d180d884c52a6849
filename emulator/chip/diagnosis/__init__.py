"""The reasons why firmware does not work, in a student's words.

::

    board = Board(firmware="lab3.elf")
    board.run_for(3)
    print(board.chip.diagnosis() or "all is well")

Decision: a diagnosis is computed once, at the end of a run, from the state of the chip. During the run only
four things are recorded, each a few machine words: the latest transfers on the sensors' buses, the latest
fault, the time of the last return to Thread mode, and the depth of the main stack. Sampling the program
counter every few milliseconds was rejected: it would slow down every correct run, and would prove nothing.

An endless loop is proven, not guessed from silence. A copy of core and memory executes the loop until its
state recurs (:mod:`probe`). The addresses that the loop reads are then compared with everything that may
still change them (:mod:`hang`).
"""

from fcu_emulator.emulator.chip.diagnosis.diagnose import diagnose, findings
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis

__all__ = ["Diagnosis", "diagnose", "findings"]
