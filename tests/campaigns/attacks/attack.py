"""The definition of an attack campaign, and its recorded results.

An attack is a function of a number of tries and a random generator. It yields the result of each try in one or two
words. A forbidden result raises an exception and is counted under the name of this exception; one forbidden result
makes the campaign fail.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import NamedTuple

Tries = Callable[[int, Random, Path], Iterator[str]]
"""Number of tries, random generator, and a folder for files."""


class Attack(NamedTuple):
    """An attack. ``usual``: number of tries in a full campaign."""

    name: str
    usual: int
    tries: Tries
    in_programs: bool = False
    """Whether each try is a separate program, whose memory counts instead of this process's memory."""


@dataclass(frozen=True)
class Outcome:
    """Results of an attack. ``worst_s``: longest time of one try; ``worst_mib``: peak memory, including loaded modules."""

    name: str
    tries: int
    outcomes: dict[str, int]
    worst_s: float
    worst_mib: float
    broken: tuple[str, ...]


def carry_out(attack: Attack, tries: int, seed: int, folder: Path) -> Outcome:
    """Make ``tries`` tries, which depend only on the seed."""
    outcomes: Counter[str] = Counter()
    broken: list[str] = []
    worst_s, made = 0.0, 0
    steps = attack.tries(tries, Random(seed), folder)
    while True:
        began_s = time.perf_counter()
        try:
            word = next(steps)
        except StopIteration:
            break
        except Exception as error:
            broken.append(f"{type(error).__name__}: {error}"[:300])
            break
        worst_s = max(worst_s, time.perf_counter() - began_s)
        outcomes[word] += 1
        made += 1
    return Outcome(
        attack.name, made, dict(outcomes.most_common()), worst_s, _memory_mib(attack), tuple(broken)
    )


def _memory_mib(attack: Attack) -> float:
    if sys.platform == "win32":
        return 0.0
    import resource

    who = resource.RUSAGE_CHILDREN if attack.in_programs else resource.RUSAGE_SELF
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(who).ru_maxrss * unit / 2**20
