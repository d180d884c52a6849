"""``fcu run``: run a board, with ``--gdb`` under a debugger."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Protocol

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.chip.memory_map import FLASH_SIZE
from fcu_emulator.emulator.cli.exit_codes import ExitCode, code_of, with_losses
from fcu_emulator.emulator.cli.isolated import announcement as isolation_announcement
from fcu_emulator.emulator.cli.options import RunOptions
from fcu_emulator.emulator.cli.run_record import RunRecord
from fcu_emulator.emulator.cli.run_report import Explainer, ProgressDisplay, summary
from fcu_emulator.emulator.cli.screen import Look, Say, gap, mark_of
from fcu_emulator.emulator.cli.screen import say as say_to_user
from fcu_emulator.emulator.clock import parse_duration, seconds
from fcu_emulator.emulator.errors import FcuError, InputError, LinkError, OutputError
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.host.isolation import limits_of_worker
from fcu_emulator.emulator.links import Addressed, ByteLink, open_link
from fcu_emulator.emulator.links.runner import Progress, Runner
from fcu_emulator.emulator.links.stdout import StdoutLink
from fcu_emulator.emulator.trace import LARGEST_FILE

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
    from fcu_emulator.emulator.chip.firmware import Limits
    from fcu_emulator.emulator.chip.gdb.server import GdbServer
    from fcu_emulator.emulator.links.control import ControlServer
    from fcu_emulator.emulator.scenario import Result


_SLOWEST, _FASTEST = 0.001, 1e6  # virtual time divided by wall time
_STOPPING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""Ctrl-C, kill, a closed terminal; on Windows Ctrl-Break and a closed console."""


def run_board(options: RunOptions) -> ExitCode:
    """Run the board and evaluate the run. Raises FcuError.

    All arguments are checked before files and ports are opened.
    """
    _check_files(options)
    board = create_board(options)
    limits = set_limits(board, options.limit)
    end_ps = run_end_ps(options, board)
    with _kept_flash(board, options.flash), ExitStack() as stack:
        speed = _speed(options.speed, options.serial, end_ps)
        tell = _silently if options.quiet else say_to_user
        links = [_open(spec, board, tell, stack) for spec in dict.fromkeys(options.serial)]
        debugger = open_debugger(board, options.gdb, options.halt, stack)
        if options.trace is not None:
            board.trace.write_to(options.trace, limits.trace_bytes if limits else LARGEST_FILE)
            stack.callback(board.trace.close)
        views = _views(options, board, limits, stack)
        record = RunRecord(board, links, options.json, stack)
        say = record.add_line if options.quiet else record.add_line_and(say_to_user)
        for line in _announcement(options, board, speed, links, debugger):
            say(line)
        control = _control_server(board, links, stack) if speed is not None else None
        exceeded = exceeded_limit(board, limits, paced=speed is not None)
        runner = Runner(board, links, end_ps, speed, exceeded, debugger=debugger)
        show = ProgressDisplay() if speed is None and not options.quiet else None
        explainer = Explainer(board, say)
        record.recorder, record.diagnoses = explainer.recorder, explainer.diagnoses

        def between_slices(progress: Progress) -> None:
            explainer.look()
            runner.stopped |= end_ps is None and _unread(links)
            if control:
                control.serve()
            if show:
                show.update(progress)

        try:
            try:
                with interruptible(runner):
                    runner.run(between_slices)
            finally:
                if show:
                    show.close()
                for link in links:
                    link.close()
                record.wall_s = runner.wall_s
                _say_summary(
                    summary(
                        board,
                        links,
                        runner.wall_s,
                        explainer.recorder,
                        all_notes=options.verbose,
                        all_uarts=options.all_uarts,
                    ),
                    say,
                    options.quiet,
                )
            code = _judge_and_say(board, runner, record)
            explainer.conclude(lambda: _explain_wrong_numbers(board, options.firmware, record.result))
            board.trace.close()
            _close_views(views, say)
        except FcuError as error:
            record.write(code_of(error), str(error))
            raise
        code = with_losses(code, sum(link.undelivered() for link in links), _unread(links))
        record.write(code)
        return code


def _say_summary(lines: Iterator[tuple[str, Look | None]], say: Say, quiet: bool) -> None:
    if not quiet:
        gap()
    for line, look in lines:
        say(line, look)


def _unread(links: Sequence[ByteLink]) -> bool:
    return bool(links) and all(isinstance(link, StdoutLink) and link.reader_gone for link in links)


def _check_files(options: RunOptions) -> None:
    named: dict[Path, str] = {}
    for option in ("json", "trace", "vcd", "perfetto", "flash"):
        path: Path | None = getattr(options, option)
        if path is not None and path in named:
            raise InputError(
                f"--{named[path]} and --{option} must not both name {path}; give two different files"
            )
        if path is not None:
            named[path] = option


@contextmanager
def _kept_flash(board: Board, path: Path | None) -> Iterator[None]:
    """Restore the flash memory from a file, and save it at the end. Raises InputError, OutputError."""
    if path is None:
        yield
        return
    if board.chip is None:
        raise InputError(f"--flash needs firmware for the chip, not {board.booted.name!r} in Python")
    if path.exists():
        board.chip.load_flash(_flash_of(path))
    try:
        yield
    finally:
        write_atomically(path, board.chip.flash_contents())


def _flash_of(path: Path) -> bytes:
    try:
        if path.is_file() and path.stat().st_size == FLASH_SIZE:
            return path.read_bytes()
    except OSError as error:
        raise InputError(f"--flash {path}: {error.strerror or error}") from error
    raise InputError(f"--flash {path}: must be a file of {FLASH_SIZE} bytes, written by an earlier run")


def create_board(options: RunOptions) -> Board:
    """Return the board for these options. Raises InputError."""
    firmware = options.firmware
    if firmware is None and options.scenario is None:
        firmware = FCU001V1.default_firmware
    return Board(
        firmware,
        scenario=options.scenario,
        wiring=options.wiring,
        seed=options.seed,
        ideal=options.ideal,
        crystal_hz=None if options.crystal is None else round(options.crystal * 1e6),
    )


def run_end_ps(options: RunOptions, board: Board) -> int | None:
    """Return the end of the run, or None if the run has no end. Raises InputError."""
    if options.duration is not None:
        try:
            return parse_duration(options.duration)
        except ValueError as error:
            raise InputError(f"--duration {error}") from error
    return board.scenario.duration_ps if board.scenario else None


def _speed(text: str | None, serial: tuple[str, ...], end_ps: int | None) -> float | None:
    """Return virtual time per wall time, or None without pacing. The default is 1 if a user watches the run."""
    if text is None:
        in_terminal = sys.stdout is not None and sys.stdout.isatty()
        watched = in_terminal or any(spec != "stdout" and not spec.startswith("file:") for spec in serial)
        return 1.0 if watched or end_ps is None else None
    if text == "max":
        return None
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not _SLOWEST <= factor <= _FASTEST:
        raise InputError(
            f"--speed must be max, or a factor of at least {_SLOWEST:g}, such as 1, 0.5 or 10, not {text!r}"
        )
    return factor


def _open(spec: str, board: Board, say: Callable[[str], None], stack: ExitStack) -> ByteLink:
    link = open_link(spec, lambda: board.terminal.uart.bit_rate, say)
    stack.callback(link.close)
    return link


def _control_server(board: Board, links: list[ByteLink], stack: ExitStack) -> ControlServer | None:
    from fcu_emulator.emulator.links.control import ControlServer
    from fcu_emulator.emulator.live.control import ControlRequests

    serial = [link.address for link in links if isinstance(link, Addressed)]
    try:
        control = ControlServer(board.booted.name, serial, ControlRequests(board).answer)
    except LinkError as error:
        say_to_user(f"fcu move and fcu terminal cannot find this board: {error}")
        return None
    stack.callback(control.close)
    return control


class View(Protocol):
    """An output file written during the run."""

    def close(self) -> None:
        """Write the remaining data. Raises OutputError."""

    def report(self) -> list[str]:
        """Return lines about missing data."""
        ...


def _views(options: RunOptions, board: Board, limits: Limits | None, stack: ExitStack) -> list[View]:
    most_bytes = limits.trace_bytes if limits else LARGEST_FILE
    views: list[View] = []
    if options.vcd is not None:
        from fcu_emulator.emulator.analysis.vcd import VcdFile

        views.append(VcdFile(board, options.vcd, most_bytes))
    if options.perfetto is not None:
        from fcu_emulator.emulator.analysis.perfetto import PerfettoFile

        views.append(PerfettoFile(board, options.perfetto, most_bytes))
    for view in views:
        stack.callback(_close, view)
    return views


def _close_views(views: list[View], say: Callable[[str], None]) -> None:
    for view in views:
        view.close()
        for line in view.report():
            say(line)


def _close(view: View) -> None:
    with suppress(OutputError):  # another error has ended the run and will be reported
        view.close()


def _announcement(
    options: RunOptions,
    board: Board,
    speed: float | None,
    links: list[ByteLink],
    debugger: GdbServer | None,
) -> Iterator[str]:
    booted = board.booted
    pace = "as fast as possible" if speed is None else f"at {speed:g} x real time"
    what = f", scenario {options.scenario}" if options.scenario else ""
    yield f"board {booted.wiring.name}, firmware {booted.name}{what}, seed {board.seed}, {pace}"
    if booted.reason:
        yield f"wiring {booted.wiring.name} was selected because {booted.reason}"
    yield from isolation_announcement()
    yield from booted.notes
    for link in links:
        yield from link.announce()
    if debugger is not None:
        yield announcement(debugger)


def set_limits(board: Board, settings: tuple[str, ...]) -> Limits | None:
    """Apply ``--limit``. Firmware for the chip always has limits."""
    if not settings:
        return board.chip.limits if board.chip else None
    from fcu_emulator.emulator.chip.firmware import parse_limits

    limits = parse_limits(settings)
    if board.chip is not None:
        board.chip.limits = limits
    return limits


def exceeded_limit(board: Board, limits: Limits | None, paced: bool) -> Callable[[float], str]:
    """Return a function that checks limits between time slices. The chip checks its own limits."""
    plan = board.scenario

    def exceeded(wall_s: float) -> str:
        if limits is not None and board.chip is None:
            limits.check_printed(board.terminal.uart.received_count())
            if not paced:  # a paced run waits, so its wall time is always long
                limits.check_wall(wall_s)
        return plan.exceeded(board, wall_s) if plan else ""

    return exceeded


@dataclass(frozen=True)
class Judgement:
    """The exit code and result of a run. ``unchecked``: why expectations were not checked."""

    code: ExitCode
    result: Result | None = None
    unchecked: str = ""


def judge_run(board: Board, runner: Runner) -> Judgement:
    """Evaluate the scenario's expectations after a full run."""
    plan = board.scenario
    if plan is None:
        return Judgement(ExitCode.PASSED)
    if board.clock.now_ps < plan.duration_ps and not runner.limit:
        lasts = f"the scenario lasts {seconds(plan.duration_ps)}"
        cause = f"the run ended at {board.now_s:.3f} s, but {lasts}" if runner.stopped else lasts
        return Judgement(ExitCode.NOT_JUDGED if plan.expectations else ExitCode.PASSED, unchecked=cause)
    result = plan.check(board, runner.limit)
    if runner.limit and not runner.limit.endswith("limits.wall"):
        return Judgement(ExitCode.FIRMWARE_FAILED, result)
    if not result.judged:
        return Judgement(ExitCode.NOT_JUDGED, result)
    return Judgement(ExitCode.PASSED if result.passed else ExitCode.FAILED, result)


def _judge_and_say(board: Board, runner: Runner, record: RunRecord) -> ExitCode:
    judgement = judge_run(board, runner)
    if judgement.result is not None and record.recorder is not None:
        judgement = replace(judgement, result=_with_sources(judgement.result, board, record.recorder))
    record.result, record.unchecked = judgement.result, judgement.unchecked
    if judgement.unchecked:
        say_to_user(f"expectations not checked: {judgement.unchecked}", "warning")
    if judgement.result is not None:
        _say_result(judgement.result, judgement.code)
    return judgement.code


def _with_sources(result: Result, board: Board, recorder: TruthRecorder) -> Result:
    """To each failed expectation, add the statement that prints the line or switches the LED."""
    if board.chip is None or board.scenario is None or result.passed:
        return result
    from fcu_emulator.emulator.analysis.source_lines import SourceLines  # slow to import: pydantic

    lines = SourceLines(recorder)
    found = (
        replace(one, source=lines.line(expectation)) if one.fault else one
        for one, expectation in zip(result.expectations, board.scenario.expectations, strict=True)
    )
    return replace(result, expectations=tuple(found))


def _explain_wrong_numbers(board: Board, firmware: str | None, result: Result | None) -> list[Diagnosis]:
    """Explain wrong numbers by a comparison with the formulas of the project's rubric."""
    if result is None or board.scenario is None or board.chip is None:
        return []
    from fcu_emulator.emulator.scenario.expectations import ExpectField  # slow to import: pydantic

    failed = {one.key for one in result.findings if one.reason == "wrong value"}
    wrong = [
        one
        for number, one in enumerate(board.scenario.expectations)
        if f"expect[{number}]" in failed and isinstance(one, ExpectField)
    ]
    if not wrong:
        return []
    from fcu_emulator.emulator.grading.explained import explained_run
    from fcu_emulator.emulator.grading.rubric import load_rubric, rubric_of

    name = firmware or board.booted.name
    return explained_run(name, load_rubric(rubric_of(name)), board.chip.limits, wrong)


def _say_result(result: Result, code: ExitCode) -> None:
    if result.findings or result.reports:
        gap()
    for line in result.reports:
        say_to_user(line)
    for finding in result.findings:
        head, *diff = finding.lines
        say_to_user(head, "fail", "FAIL")
        for line in diff:  # the diff and the source line contain program text, which must not be wrapped
            say_to_user(line, wrap=False)
    if result.checks:
        if result.findings:
            gap()
        say_to_user(f"{result.passed_count} of {result.checks} expectations met", *mark_of(code))


class Stoppable(Protocol):
    """A run that a signal handler can end."""

    def stop(self) -> None:
        """End the run soon."""
        ...


@contextmanager
def interruptible(run: Stoppable) -> Iterator[list[str]]:
    """Yield a list. A signal ends the run and adds the signal's name to this list.

    A second Ctrl-C ends the program. Ignored signals stay ignored.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        del frame
        run.stop()
        ended.append(signal.Signals(number).name)
        signal.signal(number, before[number])

    ended: list[str] = []
    if threading.current_thread() is not threading.main_thread():
        yield ended
        return
    known = [getattr(signal, name) for name in _STOPPING if hasattr(signal, name)]
    numbers = [number for number in known if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in numbers}
    if limits_of_worker() is not None:  # the parent may repeat the signal
        before[signal.SIGTERM] = signal.SIG_IGN
    try:
        yield ended
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _silently(line: str, look: Look | None = None) -> None:
    del line, look


# -- The debugger -------------------------------------------------------------------------------------------


def open_debugger(board: Board, port: int | None, halt: bool, stack: ExitStack) -> GdbServer | None:
    """Return the server, or None if ``port`` is None. ``stack`` closes the server. Raises InputError."""
    if port is None:
        if halt:
            raise InputError("--halt must be used with --gdb PORT, such as --gdb 3333")
        return None
    from fcu_emulator.emulator.chip.gdb.attach import serve

    server = serve(board, port, halt)
    stack.callback(server.close)
    return server


def announcement(server: GdbServer) -> str:
    """Return the command to type in gdb."""
    waits = "; the firmware waits for gdb" if server.halted else ""
    return f"gdb: target remote 127.0.0.1:{server.port}{waits}"
