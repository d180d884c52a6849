"""``fcu run`` as a program: readers that leave, endless input, signals, full disks."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

_FCU = (sys.executable, "-m", "fcu_emulator")
_LONGEST_S = 120
_CODES = {
    0: "held",
    2: "wrong use",
    3: "firmware failed",
    4: "not judged",
    130: "interrupted",
    141: "the reader has gone",
}
_QUICK = ("run", "lab3", "--duration", "2s", "--speed", "max")
_PACED = ("run", "lab3", "--duration", "60s", "--speed", "1")
_ITS_END = "60.000 s of virtual time"


def _told(code: int, errors: str, allowed: set[int]) -> str:
    """Return the exit code in words. Raises for a forbidden exit code, and for a traceback."""
    if code not in allowed or "Traceback" in errors:
        raise AssertionError(f"exit code {code}: {errors[-200:]}")
    return _CODES.get(code, f"signal {-code}")


def _started(*arguments: str, before: str = "", stdout: int = subprocess.PIPE) -> subprocess.Popen[str]:
    command = [*_FCU, *arguments]
    if before:
        command = ["sh", "-c", f'{before} exec "$@"', "sh", *command]
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    )


def leaving_readers(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try ``fcu run | head``: the reader takes some bytes and leaves."""
    del folder
    for _ in range(tries):
        with _started(*_QUICK) as process:
            assert process.stdout is not None
            assert process.stderr is not None
            os.read(process.stdout.fileno(), random.choice((1, 100, 600)))
            process.stdout.close()
            errors = process.stderr.read()
            code = process.wait(_LONGEST_S)
        yield _told(code, errors, {0, 141})


def floods(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try a terminal with endless input whose output is not read, or which is closed."""
    for number in range(tries):
        name = folder / f"port{number}"
        process = _started("run", "lab3", "--duration", "3s", "--speed", "2", "--serial", f"pty:{name}", "-q")
        while not name.exists():
            assert process.poll() is None, process.communicate()
            time.sleep(0.02)
        port = os.open(name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        typed = 0
        until = time.monotonic() + random.uniform(0.1, 2)
        while time.monotonic() < until and process.poll() is None:
            _, writable, _ = select.select([], [port], [], 0.05)
            try:
                typed += os.write(port, random.randbytes(4096)) if writable else 0
            except OSError:  # the board has gone, or the line is full
                break
        os.close(port)
        _, errors = process.communicate(timeout=_LONGEST_S)
        yield _told(process.returncode, errors, {0, 4})


_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGHUP under nohup", "SIGPIPE", "SIGINT twice")


def signals(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try a signal at a time between start and end. Half of the runs have a worker process."""
    del folder
    for number in range(tries):
        name = _SIGNALS[number % len(_SIGNALS)]
        ignoring = "trap '' HUP;" if "nohup" in name else ""
        kind = getattr(signal, name.split()[0])
        inherited = signal.getsignal(kind) is signal.SIG_IGN  # who runs this has said nohup
        outlives = bool(ignoring) or inherited or name == "SIGPIPE"
        run = ("run", "lab3", "--duration", "1s", "--speed", "1") if outlives else _PACED
        isolated = ("--isolate",) if random.random() < 0.5 else ()
        process = _started(*run, *isolated, before=ignoring, stdout=subprocess.DEVNULL)
        time.sleep(random.uniform(0, 1.5))
        for _ in range(2 if name.endswith("twice") else 1):
            if process.poll() is None:
                process.send_signal(kind)
        _, errors = process.communicate(timeout=_LONGEST_S)
        killed = set() if ignoring or inherited else {-kind}  # before Python was loaded
        code = process.returncode
        if code in killed or (code == 1 and "KeyboardInterrupt" in errors):
            yield f"{name}: ended while starting"
            continue
        if _ITS_END in errors:
            raise AssertionError(f"{name} was lost: {errors[-200:]}")
        told = _told(code, errors, {0, 130})
        yield f"{name}: {'ended with its summary' if code == 0 and not outlives else told}"


def disks(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try standard output, trace and summary on a full device, or with a limited file size."""
    for _ in range(tries):
        place = random.choice(("stdout", "--trace", "--json"))
        how = random.choice(("/dev/full", "limit"))
        target = Path("/dev/full") if how == "/dev/full" else folder / "output"
        target.unlink(missing_ok=True) if how == "limit" else None
        more = () if place == "stdout" else (place, str(target))
        limit = f"ulimit -f {random.choice((0, 1, 4))};" if how == "limit" else ""
        with (target if place == "stdout" else Path(os.devnull)).open("wb", buffering=0) as stdout:
            process = _started(*_QUICK, "--duration", "5s", *more, before=limit, stdout=stdout.fileno())
        _, errors = process.communicate(timeout=_LONGEST_S)
        fits = how == "limit"  # what is written may be smaller than the limit
        yield f"{place}: {_told(process.returncode, errors, {0, 4} if fits else {4})}"
