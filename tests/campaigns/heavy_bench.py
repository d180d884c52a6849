"""Speed of the programs of :mod:`tests.support.arm.heavy_programs`, relative to real time.

::

    python -m tests.campaigns.heavy_bench            # all
    python -m tests.campaigns.heavy_bench RCC        # programs whose name matches

Each row has CPU seconds for a virtual second; executed (not skipped) instructions, accesses and work, in millions
for a virtual second; and nanoseconds for a unit of work. The limit on work relies on this figure. If the figure is
much higher than in other rows, the weight of the work is too small (work.h).
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from fcu_emulator.emulator.chip.firmware import Limits
from tests.support.arm.heavy_programs import all_programs
from tests.support.arm.hostile_programs import board_with

_FIRST_S, _SLICE_S, _LONGEST_S, _CPU_S = 0.0002, 0.0001, 0.2, 0.3


def measure(data: bytes) -> tuple[float, float, float, float, float]:
    """Return CPU time, instructions, accesses and work (in millions) per virtual second, and ns per unit of work."""
    with tempfile.TemporaryDirectory() as folder:
        board = board_with(data, Path(folder))
    assert board.chip is not None
    board.chip.limits = replace(Limits(), work_per_s=10**15, resets_per_s=9_999)
    core = board.chip.core
    board.run_for(_FIRST_S)
    before, work, began_s, began_cpu_s = core.status(), core.work, board.now_s, time.process_time()
    executed, accesses = before.retired - before.skipped, before.accesses
    slice_s = _SLICE_S
    while time.process_time() - began_cpu_s < _CPU_S and board.now_s - began_s < _LONGEST_S:
        board.run_for(slice_s)
        slice_s *= 1.5 if time.process_time() - began_cpu_s < _CPU_S / 4 else 1
    cpu_s, virtual_s = time.process_time() - began_cpu_s, board.now_s - began_s
    after = core.status()
    executed, accesses = after.retired - after.skipped - executed, after.accesses - accesses
    work = core.work - work
    board.close()
    rates = (number / virtual_s / 1e6 for number in (executed, accesses, work))
    return cpu_s / virtual_s, *rates, cpu_s * 1e9 / max(1, work)


def main() -> None:
    """Print the table."""
    pattern = sys.argv[1] if len(sys.argv) > 1 else ""
    sys.stdout.write(
        f"{'program':<45} {'CPU':>9} {'M instr.':>9} {'M acc.':>9} {'M work':>9} {'ns/unit':>9}\n"
    )
    for name, data in all_programs().items():
        if re.search(pattern, name):
            sys.stdout.write(f"{name:<45} {' '.join(f'{number:9.2f}' for number in measure(data))}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
