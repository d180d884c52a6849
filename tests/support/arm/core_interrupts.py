"""Interrupt handlers that log their beginning and end, for tests of priorities and masks."""

from __future__ import annotations

from tests.support.arm.core_bench import CoreBench, interrupts

HANDLERS = """
irq0: log 10
      movs r3, #30
wait0: subs r3, #1
      bne wait0
      log 11
      bx lr
irq1: log 20
      movs r3, #30
wait1: subs r3, #1
      bne wait1
      log 21
      bx lr
irq2: log 30
      log 31
      bx lr
"""
"""Interrupts 0 and 1 take about 70 us, number 2 about 10; each logs its beginning and its end."""


def bench(priorities: dict[int, int], before: str = "") -> CoreBench:
    """Return a bench that waits with these interrupts from long before 200 us, when it has logged 1."""
    return CoreBench(f"reset: {interrupts(priorities)} {before} log 1\n b .\n {HANDLERS}")
