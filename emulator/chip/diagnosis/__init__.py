"""Why a firmware does nothing sensible any more, in a student's words.

::

    board = Board(firmware="lab3.elf")
    board.run_for(3)
    print(board.chip.diagnosis() or "all is well")

Decision: everything is worked out once, at the end of a run, from what the chip then is. While it runs only
four things are kept, each a few machine words: the latest transfers on the sensors' buses, the latest fault,
when Thread mode was last returned to, and how deep the main stack went. The road not taken, to look at the
program counter every few milliseconds, would cost every good run for the sake of the bad ones, and would
prove nothing.

That a loop is never left is proven, not guessed from silence: a copy of core and memory executes it until its
state recurs (:mod:`probe`), and whatever the loop looks at is then held against whatever could still change
it (:mod:`hang`).
"""

from fcu_emulator.emulator.chip.diagnosis.diagnose import diagnose, findings
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis

__all__ = ["Diagnosis", "diagnose", "findings"]
