"""``fcu run``: announce, run, summarise; with ``--gdb PORT [--halt]`` under a debugger."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from emulator.board.board import Board
from emulator.boards.fcu001v1 import FCU001V1
from emulator.cli.run_report import Explainer, ProgressDisplay, summary
from emulator.errors import InputError
from emulator.links import ByteLink, open_link
from emulator.links.runner import Progress, Runner
from emulator.time.durations import parse_duration, seconds

if TYPE_CHECKING:
    from emulator.chip.gdb.server import GdbServer


_SLOWEST, _FASTEST = 0.001, 1e6  # virtual over wall time
_STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C, kill, a terminal window that is closed


@dataclass(frozen=True)
class RunOptions:
    """The arguments of ``fcu run`` as typed."""

    firmware: str | None
    profile: str | None
    scenario: str | None
    duration: str | None
    speed: str | None
    serial: tuple[str, ...]
    seed: int | None
    ideal: bool
    trace: Path | None
    quiet: bool
    gdb: int | None = None
    halt: bool = False
    limit: tuple[str, ...] = ()


def run_board(options: RunOptions) -> bool:
    """Run the board as asked; False when the scenario's expectations did not hold.

    Nothing is opened before the arguments have been understood; the links come first, the trace file last.
    """
    board = _create_board(options)
    _set_limits(board, options.limit)
    end_ps = _end(options, board)
    with ExitStack() as stack:
        speed = _speed(options.speed, options.serial, end_ps)
        links = [_open(spec, stack) for spec in dict.fromkeys(options.serial)]
        debugger = open_debugger(board, options.gdb, options.halt, stack)
        if options.trace is not None:
            board.trace.write_to(options.trace)
            stack.callback(board.trace.close)
        say = _quiet if options.quiet else _to_stderr
        for line in _announcement(options, board, speed, links):
            say(line)
        if debugger is not None:
            say(announcement(debugger))
        runner = Runner(board, links, end_ps, speed, _limits(board), debugger=debugger)
        show = ProgressDisplay() if speed is None and not options.quiet else None
        explainer = Explainer(board, say)

        def between_slices(progress: Progress) -> None:
            explainer.look()
            if show:
                show.update(progress)

        try:
            with _interruptible(runner):
                runner.run(between_slices)
        finally:
            if show:
                show.close()
            for link in links:
                link.close()
            for line in summary(board, links, runner.wall_s):
                say(line)
        passed = runner.stopped or _check(board, end_ps, runner.limit)
        explainer.conclude()
        return passed


def _create_board(options: RunOptions) -> Board:
    firmware = options.firmware
    if firmware is None and options.scenario is None:
        firmware = FCU001V1.default_firmware
    return Board(
        firmware,
        scenario=options.scenario,
        profile=options.profile,
        seed=options.seed,
        ideal=options.ideal,
    )


def _set_limits(board: Board, settings: tuple[str, ...]) -> None:
    """``--limit``: what firmware built for the chip may take."""
    if not settings:
        return
    if board.arm is None:
        raise InputError("--limit is for firmware built for the chip; a scenario has [limits] for any other")
    from emulator.chip.limits import parse_limits

    board.arm.limits = parse_limits(settings)


def _end(options: RunOptions, board: Board) -> int | None:
    """When the run ends, in ps of virtual time; None for never."""
    if options.duration is not None:
        try:
            return parse_duration(options.duration)
        except ValueError as error:
            raise InputError(f"--duration {error}") from error
    return board.scenario.duration_ps if board.scenario else None


def _speed(text: str | None, serial: tuple[str, ...], end_ps: int | None) -> float | None:
    """Virtual over wall time, None for no pacing: who watches gets real time, a script does not wait."""
    if text is None:
        watched = any(spec != "stdout" for spec in serial) or sys.stdout.isatty()
        return 1.0 if watched or end_ps is None else None
    if text == "max":
        return None
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not _SLOWEST <= factor <= _FASTEST:
        raise InputError(f"--speed {text}: give max, or a factor from {_SLOWEST:g} up, such as 1, 0.5 or 10")
    return factor


def _open(spec: str, stack: ExitStack) -> ByteLink:
    link = open_link(spec)
    stack.callback(link.close)
    return link


def _announcement(
    options: RunOptions, board: Board, speed: float | None, links: list[ByteLink]
) -> Iterator[str]:
    booted = board.booted
    pace = "as fast as possible" if speed is None else f"at {speed:g} x real time"
    what = f", scenario {options.scenario}" if options.scenario else ""
    yield f"board {booted.profile.name}, firmware {booted.name}{what}, seed {board.seed}, {pace}"
    if booted.reason:
        yield f"profile {booted.profile.name} because the firmware says so: {booted.reason}"
    yield from booted.notes
    for link in links:
        yield from link.announce()


def _limits(board: Board) -> Callable[[float], str]:
    plan = board.scenario
    if plan is None:
        return lambda _wall_s: ""
    return partial(plan.exceeded, board)


def _check(board: Board, end_ps: int | None, limit: str) -> bool:
    plan = board.scenario
    if plan is None:
        return True
    if end_ps is not None and end_ps < plan.duration_ps:
        _to_stderr(f"expectations not checked: the scenario lasts {seconds(plan.duration_ps)}")
        return True
    result = plan.check(board, limit)
    for line in result.lines:
        _to_stderr(line)
    return result.passed


@contextmanager
def _interruptible(runner: Runner) -> Iterator[None]:
    """Ctrl-C ends the run at the next slice, with its summary; a second one ends the program."""

    def stop(number: int, frame: FrameType | None) -> None:
        del frame
        runner.stop()
        signal.signal(number, before[number])

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in _STOPPING if hasattr(signal, name)]
    before = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _to_stderr(line: str) -> None:
    with suppress(OSError):  # stderr may be full or gone; the run goes on
        click.echo(f"fcu: {line}", err=True)


def _quiet(line: str) -> None:
    del line


# -- The debugger -------------------------------------------------------------------------------------------


def open_debugger(board: Board, port: int | None, halt: bool, stack: ExitStack) -> GdbServer | None:
    """The server, closed with ``stack``; None if nobody wants one.

    Raises InputError if there is nothing to debug, or the port cannot be had.
    """
    if port is None:
        if halt:
            raise InputError("--halt waits for a debugger; give --gdb PORT as well, such as --gdb 3333")
        return None
    from emulator.chip.gdb.attach import serve

    server = serve(board, port, halt)
    stack.callback(server.close)
    return server


def announcement(server: GdbServer) -> str:
    """What the user has to type in gdb."""
    waits = ", the firmware waits for it" if server.halted else ""
    return f"gdb: target remote 127.0.0.1:{server.port}{waits}"
