"""The commands of ``fcu`` and their arguments. A command returns its exit code."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from fcu_emulator.emulator.cli.completion import PART, RUBRIC, SCENARIO
from fcu_emulator.emulator.cli.declare import Command, reads
from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.options import (
    BUS,
    PATH,
    CheckOptions,
    DiffOptions,
    GradeOptions,
    MoveOptions,
    RunOptions,
    WebOptions,
)


def _show_version(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    del parameter
    if wanted and not context.resilient_parsing:
        from fcu_emulator.emulator.cli.version import version_lines

        click.echo("\n".join(version_lines()))
        context.exit()


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_show_version,
    help="Show the version, the commit and the C library.",
)
def cli() -> None:
    """A virtual STEVAL-FCU001V1 sensor board: its sensors, its firmware, its serial terminal."""


cli.command_class = Command


@cli.command()
@reads(RunOptions)
def run(options: RunOptions) -> ExitCode:
    """Run FIRMWARE on the virtual board.

    FIRMWARE is lab3 or template (in Python), solution or template-arm (in C, for the chip), or your own ELF,
    HEX or BIN file. The terminal's text goes to stdout, all other output to stderr. Ctrl-C ends the run.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_run

    isolated, limit = limits_of_run(options.limit, options.isolate)
    if isolated is not None:
        return in_worker(isolated)
    options = replace(options, limit=limit)
    if options.boards is None:
        from fcu_emulator.emulator.cli.run import run_board

        return run_board(options)

    from fcu_emulator.emulator.cli.run_boards import run_on_boards

    return run_on_boards(options, options.boards)


@cli.command()
@click.argument("record", metavar="RUN", type=PATH)
@click.option(
    "-o",
    "--output",
    type=PATH,
    help="The picture: a PNG, SVG or PDF file. Default: RUN with the ending .png.",
)
def plot(record: Path, output: Path | None) -> None:
    """Draw a run's printed numbers with the true values at the same times.

    RUN is the file of fcu run --json.
    """
    from fcu_emulator.emulator.cli.plot import draw_record

    draw_record(record, output)


@cli.command(short_help="Connect a terminal to a running board.")
@click.argument("where", required=False)
@click.option("--board", metavar="PROCESS", help="Process id of the board, if several run.")
def terminal(where: str | None, board: str | None) -> ExitCode:
    """Connect a terminal to a running board: type and read, until Ctrl-].

    WHERE is tcp:PORT, rfc2217:PORT, or a serial port such as /dev/ttyACM0 or COM3 (also of a real board).
    Default: the board that runs on this machine.
    """
    from fcu_emulator.emulator.cli.terminal import converse

    return converse(where, board)


@cli.command(
    short_help="Move the running board: tilt, lift, tap, shake.",
    context_settings={"ignore_unknown_options": True},  # a number may be negative
)
@reads(MoveOptions)
def move(options: MoveOptions) -> None:
    """Move the running board: fcu move --roll 30 --for 1s, fcu move lift 2, fcu move tap.

    The gestures have the same names in scenarios; the gesture flat lays the board on the floor. AMOUNT is in
    metres for lift and pass_magnet (distance of the magnet), in g for tap and shake, and in turns for
    figure_eight. --north, --east and --up push the board straight. Without a move, the command prints the
    board's attitude.
    """
    from fcu_emulator.emulator.cli.move import move as move_board

    move_board(options)


@cli.command(short_help="Show where two firmwares first differ on the same scenario.")
@reads(DiffOptions)
def diff(options: DiffOptions) -> ExitCode:
    """Run firmwares A and B on the same scenario and show where they first differ.

    The command compares the terminal's lines, the register writes of each sensor, the edges of the LEDs, and
    the times of all these. Exit code 0: no difference, 1: differences, 2: wrong use, 3: both programs failed
    in the same way, 4: not comparable.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_run

    isolated, limit = limits_of_run(options.limit, options.isolate)
    if isolated is not None:
        return in_worker(isolated)

    from fcu_emulator.emulator.cli.diff import compare_firmwares

    return compare_firmwares(replace(options, limit=limit))


@cli.command()
@reads(GradeOptions)
def grade(options: GradeOptions) -> ExitCode:
    """Judge the programs of a class by a rubric, and write reports.

    SUBMISSIONS is a folder (or its zip file) with an entry for each student: a folder, a zip file, main.c or
    a built file. Programs that were judged before are not judged again: the same command resumes an
    interrupted run. Exit code 0: each submission is judged, or the reports say why it cannot be
    judged; 4: some were not judged, and the students are not the cause.
    """
    from fcu_emulator.emulator.cli.grade import grade as grade_class

    return grade_class(options)


@cli.command()
@reads(WebOptions)
def web(options: WebOptions) -> ExitCode:
    """Show the board live in the browser: move it, watch it, plot it.

    FIRMWARE is as for fcu run. A file is loaded again when it changes. Ctrl-C ends the server.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_process

    isolated = limits_of_process(options.limit, options.isolate)
    if isolated is not None:
        return in_worker(isolated)

    from fcu_emulator.emulator.cli.web import serve_board

    return serve_board(options)


@cli.command(short_help="Serve the board to a coding agent (Model Context Protocol).")
def mcp() -> ExitCode:
    """Serve the board to a coding agent by the Model Context Protocol, on standard input and output.

    The agent's client starts this command. The guide docs/agents.md has the client's configuration.
    """
    from fcu_emulator.emulator.cli.agents import serve_agent

    return serve_agent()


@cli.command()
@click.argument("directory", metavar="DIR", type=PATH)
@click.option(
    "--bus",
    type=BUS,
    default="I2C2",
    show_default=True,
    help="Bus of the sensors: I2C2 in the lab, SPI2 on the real board.",
)
@click.option(
    "--rubric",
    metavar="NAME|FILE",
    shell_complete=RUBRIC,
    help="Rubric of this project. Default: the rubric of LAB3.",
)
def new(directory: Path, bus: str, rubric: str | None) -> None:
    """Start a LAB3 program in C in the new folder DIR."""
    from fcu_emulator.emulator.cli.new import create_project

    create_project(directory, bus, rubric)


@cli.command(short_help="Build a project of fcu new without make.")
@click.argument("folder", default=".", type=click.Path(path_type=Path, file_okay=False))
def build(folder: Path) -> None:
    """Build lab3.elf in FOLDER, a project of `fcu new`. Default: the current folder.

    The file is the same as the file that make builds, but you do not need make. The compiler may be on the PATH,
    or in the folder of STM32CubeIDE, of Arm's installer, of xPack or of PlatformIO.
    """
    from fcu_emulator.emulator.cli.build import build_and_say

    build_and_say(folder)


@cli.command(short_help="Show completed exercises, problems and the next step.")
@reads(CheckOptions)
def check(options: CheckOptions) -> ExitCode:
    """Show completed exercises, the problems of the next one, and the next step.

    FOLDER is a project of `fcu new`, which is built first. Default: the current folder. FILE is an ELF, HEX
    or BIN file, or a firmware's name. Exit code 0: all checks passed, 1: some failed, 2: the program does not
    build or cannot be used, 3: the program crashed or hung, 4: something could not be judged.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_process

    isolated = limits_of_process(options.limit, options.isolate)
    if isolated is not None:
        return in_worker(isolated)

    from fcu_emulator.emulator.cli.check import check_program

    return check_program(options)


@cli.command(short_help="List the scenarios and the question that each one answers.")
def scenarios() -> None:
    """List the scenarios of fcu and the question that each one answers."""
    from fcu_emulator.emulator.cli.listings import list_scenarios

    list_scenarios()


@cli.group()
def scenario() -> None:
    """Check scenario files, and print their schema."""


@scenario.command("check")
@click.argument("file", shell_complete=SCENARIO)
def check_file(file: str) -> None:
    """Check a scenario FILE without running it."""
    from fcu_emulator.emulator.cli.listings import check_scenario

    check_scenario(file)


@scenario.command()
def schema() -> None:
    """Print the JSON schema of scenario files, for an editor's completion."""
    from fcu_emulator.emulator.cli.listings import print_schema

    print_schema()


@cli.group()
def rubric() -> None:
    """Check rubrics, and print their schema."""


@rubric.command("check")
@click.argument("file", shell_complete=RUBRIC)
@click.option("--file-only", is_flag=True, help="Only check the file; judge no programs.")
def check_rubric_file(file: str, file_only: bool) -> None:
    """Check a rubric FILE, and show the points of programs that do not solve the lab."""
    from fcu_emulator.emulator.cli.rubric_check import check_rubric

    check_rubric(file, not file_only)


@rubric.command("schema")
def rubric_schema() -> None:
    """Print the JSON schema of rubrics, for an editor's completion."""
    from fcu_emulator.emulator.cli.listings import print_rubric_schema

    print_rubric_schema()


@cli.command(short_help="Print the register map of a sensor or a peripheral of the chip.")
@click.argument("part", required=False, shell_complete=PART)
@click.option("--fidelity", is_flag=True, help="Show instead how completely each part is modelled.")
def registers(part: str | None, fidelity: bool) -> None:
    """Print the register map of PART: a sensor (LSM6DSL) or a peripheral of the chip (TIM9), with its fields."""
    from fcu_emulator.emulator.cli.listings import print_fidelity, print_registers

    if fidelity:
        print_fidelity()
    else:
        print_registers(part)


@cli.command(short_help="Check this machine: Python packages, C compiler, serial ports.")
def doctor() -> ExitCode:
    """Check this machine: Python packages, C compiler, serial ports; show how to install missing parts."""
    from fcu_emulator.emulator.cli.doctor import examine

    return ExitCode.PASSED if examine() else ExitCode.USAGE_ERROR
