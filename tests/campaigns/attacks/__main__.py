"""``python -m tests.campaigns.attacks``: a table of attacks, tries, outcomes, the worst time and the worst memory.

::

    ATTACK ...        names of attacks; default: all
    --tries NUMBER    tries of each attack, instead of those of a full campaign
    --seed NUMBER     seed of the tries; default: 1

Each attack has a separate process, so that its memory can be measured. The exit code is 1 after a forbidden result:
an exception that is not an error of this package, a message that is not a line, or an exit code that is not a verdict.
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from tests.campaigns.attacks import classes, files, gdb, page, programs
from tests.campaigns.attacks.attack import Attack, Outcome, carry_out

ATTACKS = (
    Attack("scenarios", 10_000, files.scenarios),
    Attack("recordings", 10_000, files.recordings),
    Attack("ELF files", 10_000, files.elf_files),
    Attack("HEX files", 10_000, files.hex_files),
    Attack("archives of submissions", 20_000, classes.archives),
    Attack("names of submissions", 10_000, classes.names),
    Attack("rosters and rubrics", 10_000, classes.tables),
    Attack("gdb connections", 1_000, gdb.connections),
    Attack("page requests", 20_000, page.requests),
    Attack("page messages", 20_000, page.messages),
    Attack("readers that leave", 100, programs.leaving_readers, in_programs=True),
    Attack("typing that floods", 50, programs.floods, in_programs=True),
    Attack("signals", 120, programs.signals, in_programs=True),
    Attack("full disks", 100, programs.disks, in_programs=True),
)
BY_NAME = {attack.name: attack for attack in ATTACKS}


def row(outcome: Outcome) -> str:
    """One line of the table."""
    words = [f"{word} {count}" for word, count in outcome.outcomes.items()]
    words += [f"BROKEN {one}" for one in outcome.broken]
    return (
        f"| {outcome.name} | {outcome.tries} | {'; '.join(words)} | {outcome.worst_s:.2f} s "
        f"| {outcome.worst_mib:.0f} MiB |"
    )


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.attacks")
    parser.add_argument("attack", nargs="*", choices=[*BY_NAME, []], metavar="ATTACK")
    parser.add_argument("--tries", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--as-json", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.as_json:
        attack = BY_NAME[given.attack[0]]
        with tempfile.TemporaryDirectory() as folder:
            outcome = carry_out(attack, given.tries or attack.usual, given.seed, Path(folder))
        sys.stdout.write(json.dumps(asdict(outcome)))
        return 0
    sys.stdout.write("| attack | tries | outcome | worst time | worst memory |\n|---|---|---|---|---|\n")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's & has it ignored, and all below
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup likewise
    broken = False
    for name in given.attack or BY_NAME:
        command = [
            sys.executable,
            "-m",
            "tests.campaigns.attacks",
            name,
            "--as-json",
            "--seed",
            str(given.seed),
        ]
        command += ["--tries", str(given.tries)] if given.tries else []
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.stdout.write(f"| {name} | | BROKEN: the process ended with {done.returncode} | | |\n")
            sys.stdout.write(done.stderr)
            broken = True
            continue
        outcome = Outcome(**json.loads(done.stdout))
        broken |= bool(outcome.broken)
        sys.stdout.write(f"{row(outcome)}\n")
        sys.stdout.flush()
    return int(broken)


if __name__ == "__main__":
    sys.exit(main())
