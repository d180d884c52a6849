"""``fcu run --scenario S --boards N``: run a program on N boards."""

from __future__ import annotations

from dataclasses import replace

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.cli.boards_table import BoardResult, BoardsTable
from fcu_emulator.emulator.cli.exit_codes import ExitCode, code_of
from fcu_emulator.emulator.cli.options import RunOptions
from fcu_emulator.emulator.cli.run import (
    create_board,
    exceeded_limit,
    judge_run,
    run_end_ps,
    set_limits,
)
from fcu_emulator.emulator.cli.run_report import Explainer
from fcu_emulator.emulator.cli.screen import Look, ProgressLine
from fcu_emulator.emulator.errors import FirmwareError, InputError, NotJudgedError
from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.links.runner import Runner

_OF_ONE_BOARD: dict[str, tuple[object, ...]] = {
    "serial": (("stdout",),),
    "speed": (None, "max"),
    "trace": (None,),
    "vcd": (None,),
    "perfetto": (None,),
    "json": (None,),
    "flash": (None,),
    "gdb": (None,),
    "halt": (False,),
    "verbose": (False,),
}
"""Restricted options for a run on several boards, with the allowed values."""


def run_on_boards(options: RunOptions, count: int) -> ExitCode:
    """Run on ``count`` boards, and print a line for each board and a summary. Raises FcuError."""
    _refuse_useless(options)
    board = create_board(options)
    if board.scenario is None or not board.scenario.expectations:
        raise InputError(f"--boards must have a scenario with expectations, not {options.scenario}")
    table = BoardsTable(f"{options.scenario}: {board.booted.name}", "meet all expectations", "is not met")
    first = board.seed
    for seed in range(first, first + count):
        if seed != first:
            board = create_board(replace(options, seed=seed))
        try:
            with ProgressLine(f"running board {seed}, {seed - first} of {count} done"):
                result = _on_board(options, board)
            table.add(result)
        finally:
            board.close()
    return table.conclude(_again(options))


def _refuse_useless(options: RunOptions) -> None:
    if options.scenario is None:
        raise InputError("--boards must be used with --scenario")
    if options.ideal:
        raise InputError("--boards must be used without --ideal, because the sensors must differ")
    for name, possible in _OF_ONE_BOARD.items():
        if getattr(options, name) not in possible:
            raise InputError(f"--boards must be used without --{name}")


def _on_board(options: RunOptions, board: Board) -> BoardResult:
    limits = set_limits(board, options.limit)
    exceeded = exceeded_limit(board, limits, paced=False)
    runner = Runner(board, [], run_end_ps(options, board), None, exceeded)
    explainer = Explainer(board, _silently)
    code, why = ExitCode.PASSED, ""
    try:
        runner.run()
        judgement = judge_run(board, runner)
        code, why = judgement.code, judgement.unchecked or runner.limit
        explainer.conclude()
    except (FirmwareError, NotJudgedError) as error:
        return _failed(board, error)
    result = judgement.result
    if result is None:
        return BoardResult(board.seed, "not judged", (), code, why)
    missed = dict.fromkeys(f"{one.key} ({one.kind})" for one in result.findings if one.kind != "run")
    return BoardResult(board.seed, f"{result.passed_count} of {result.checks}", tuple(missed), code, why)


def _failed(board: Board, error: FirmwareError | NotJudgedError) -> BoardResult:
    code = code_of(error)
    score = "not judged" if code == ExitCode.NOT_JUDGED else "failed"
    return BoardResult(board.seed, score, (), code, str(error).splitlines()[0])


def _again(options: RunOptions) -> str:
    words = ["fcu", "run", *([options.firmware] if options.firmware is not None else [])]
    words += ["--scenario", str(options.scenario)]
    for name in ("wiring", "duration"):
        if (value := getattr(options, name)) is not None:
            words += [f"--{name}", value]
    return command_line([*words, *(word for limit in options.limit for word in ("--limit", limit))])


def _silently(line: str, look: Look | None = None) -> None:
    del line, look
