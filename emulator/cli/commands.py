"""The commands of ``fcu`` and their arguments; what each does lies beside this file.

Everything heavy is imported inside the commands, so that ``fcu --help`` answers at once. A command returns
its exit code.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import click

from fcu_emulator.emulator.cli.exit_codes import ExitCode

Ignorable: TypeAlias = Literal["time", "numbers", "registers", "leds"]  # as in emulator.analysis.compare


_PATH = click.Path(path_type=Path)
_ISOLATE = click.option(
    "--isolate", is_flag=True, help="Run in a process of its own, with limits on memory, CPU and files."
)
_LIMIT_OF_PROCESS = click.option(
    "--limit",
    multiple=True,
    metavar="NAME=NUMBER",
    help="With --isolate: what the process may take, such as cpu_s=600; may be repeated.",
)


_GESTURES = ("lift", "tap", "shake", "free_fall", "figure_eight", "turn_over", "pass_magnet", "flat")


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="fcu-emulator", message="fcu-emulator %(version)s")
def cli() -> None:
    """A virtual STEVAL-FCU001V1 sensor board: its sensors, its firmware, its serial terminal."""


@cli.command()
@click.argument("firmware", required=False)
@click.option("--profile", help="How the sensors are wired: lab3 or fcu001v1. Default: as the firmware says.")
@click.option("--scenario", metavar="NAME|FILE", help="Move the board, and check what it prints.")
@click.option("--duration", metavar="TIME", help="Virtual time to run, such as 10s or 500ms.")
@click.option("--speed", metavar="FACTOR|max", help="Virtual over wall time. Default: 1 with a terminal.")
@click.option(
    "--serial",
    multiple=True,
    metavar="LINK",
    help="stdout (default), port, pty[:LINK], tcp[:PORT], rfc2217[:PORT] or file:PATH; may be repeated.",
)
@click.option(
    "--seed", type=int, help="Which board of the class, and its noise. Default: the scenario's, or 0."
)
@click.option(
    "--boards",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="With --scenario: on N boards, with a summary.",
)
@click.option("--ideal", is_flag=True, help="Sensors without noise, offset or scale error.")
@click.option("--trace", type=click.Path(path_type=Path), help="Write every event to a JSON-lines file.")
@click.option("--vcd", type=click.Path(path_type=Path), help="Write the board's wires, for logic analysers.")
@click.option(
    "--perfetto", type=click.Path(path_type=Path), help="Write a time line of functions, buses and LEDs."
)
@click.option("--quiet", "-q", is_flag=True, help="Nothing on stderr but a scenario's verdict.")
@click.option(
    "--gdb",
    type=click.IntRange(0, 65535),
    metavar="PORT",
    help="Let gdb debug the firmware, on this port of 127.0.0.1 (0: any free one).",
)
@click.option("--halt", is_flag=True, help="With --gdb: wait for gdb before the first instruction.")
@click.option(
    "--limit",
    multiple=True,
    metavar="NAME=NUMBER",
    help="What a run may take, such as wall_s=60; may be repeated.",
)
@click.option("--json", type=click.Path(path_type=Path), help="Write the whole summary to a JSON file.")
@click.option("--notes", is_flag=True, help="At the end all notes, those of every right run, too.")
@_ISOLATE
@click.pass_context
def run(
    context: click.Context, /, serial: tuple[str, ...], limit: tuple[str, ...], isolate: bool, **options: Any
) -> ExitCode:
    """Run FIRMWARE on the virtual board.

    FIRMWARE is lab3 or template (in Python), solution or template-arm (in C, for the chip), or your own ELF,
    HEX or BIN file. The terminal's text goes to stdout, everything else to stderr. Ctrl-C ends the run.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_run

    isolated, limit = limits_of_run(limit, isolate)
    if isolated is not None:
        return in_worker(context.obj, isolated)

    from fcu_emulator.emulator.cli.run import RunOptions, run_board

    asked = RunOptions(serial=serial or ("stdout",), limit=limit, **options)
    if asked.boards is None:
        return run_board(asked)

    from fcu_emulator.emulator.cli.run_boards import run_on_boards

    return run_on_boards(asked, asked.boards)


@cli.command()
@click.argument("record", metavar="RUN", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The picture, PNG, SVG or PDF by its name. Default: RUN with .png.",
)
def plot(record: Path, output: Path | None) -> None:
    """Draw what a run has printed over the truth of the same moments.

    RUN is the file of fcu run --json.
    """
    from fcu_emulator.emulator.cli.plot import draw_record

    draw_record(record, output)


@cli.command(short_help="Be the terminal of a board that runs.")
@click.argument("where", required=False)
@click.option("--board", metavar="PROCESS", help="Of several boards that run, the one in this process.")
def terminal(where: str | None, board: str | None) -> ExitCode:
    """Be the terminal of a board that runs: type and read, until Ctrl-].

    WHERE is tcp:PORT, rfc2217:PORT, or a serial port such as /dev/ttyACM0 or COM3, a real board's too.
    Without it, the port of the board that runs on this machine.
    """
    from fcu_emulator.emulator.cli.terminal import converse

    return converse(where, board)


@cli.command(
    short_help="Move the board that runs: tilt, lift, tap, shake and so on.",
    context_settings={"ignore_unknown_options": True},  # a number may be negative
)
@click.argument(
    "gesture",
    required=False,
    type=click.Choice([*_GESTURES, "fall", "eight", "over", "magnet", "reset"]),
    metavar=f"[{'|'.join(_GESTURES)}]",
)
@click.argument("amount", type=float, required=False)
@click.option("--roll", type=float, metavar="DEG", help="Turn to this angle; those not given stay.")
@click.option("--pitch", type=float, metavar="DEG")
@click.option("--yaw", type=float, metavar="DEG")
@click.option("--for", "duration", metavar="TIME", help="How long it takes, such as 1s. Default: as a hand.")
@click.option("--axis", type=click.Choice(["north", "west", "up"]), help="Of tap and shake.")
@click.option("--board", metavar="PROCESS", help="Of several boards that run, the one in this process.")
def move(
    gesture: str | None,
    amount: float | None,
    roll: float | None,
    pitch: float | None,
    yaw: float | None,
    duration: str | None,
    axis: str | None,
    board: str | None,
) -> None:
    """Move the board that runs: fcu move --roll 30 --for 1s, fcu move lift 2, fcu move tap.

    GESTURE is lift, tap, shake, free_fall, figure_eight, turn_over, pass_magnet or flat: the words of
    scenarios; flat lays the board on the floor. AMOUNT is the metres of lift and pass_magnet (how far away it
    passes), the g of tap and shake, the turns of figure_eight. Without a move: the board's attitude.
    """
    from fcu_emulator.emulator.cli.move import MoveOptions
    from fcu_emulator.emulator.cli.move import move as move_board

    move_board(MoveOptions(gesture, amount, roll, pitch, yaw, duration, axis, board))


@cli.command(short_help="Show where two firmwares first differ on the same scenario.")
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@click.option("--scenario", metavar="NAME|FILE", required=True, help="What both are put through.")
@click.option("--profile", help="lab3 or fcu001v1; default: what each firmware is made for.")
@click.option("--seed", type=int, help="Which board of the class, and its noise. Default: the scenario's.")
@click.option("--ideal", is_flag=True, help="Sensors without noise, offset or scale error.")
@click.option("--duration", metavar="TIME", help="Virtual time to compare. Default: the scenario's.")
@click.option(
    "--timing", metavar="TIME", default="20ms", show_default=True, help="How far apart the pace may be."
)
@click.option(
    "--tolerance",
    multiple=True,
    metavar="FIELD=NUMBER",
    help="How far printed numbers may be apart, such as ACC=0.5 or Yaw=0.1; may be repeated.",
)
@click.option(
    "--ignore",
    multiple=True,
    type=click.Choice(get_args(Ignorable)),
    help="What not to compare; may be repeated.",
)
@click.option("--replay", is_flag=True, help="A (lab3 or template) gets the samples that B read.")
@click.option(
    "--limit",
    multiple=True,
    metavar="NAME=NUMBER",
    help="What each run may take, such as wall_s=60; may be repeated.",
)
@_ISOLATE
@click.pass_context
def diff(
    context: click.Context,
    first: str,
    second: str,
    scenario: str,
    profile: str | None,
    seed: int | None,
    ideal: bool,
    duration: str | None,
    timing: str,
    tolerance: tuple[str, ...],
    ignore: tuple[Ignorable, ...],
    replay: bool,
    limit: tuple[str, ...],
    isolate: bool,
) -> ExitCode:
    """Run firmwares A and B on the same scenario and show where they first differ.

    Compared are the terminal's lines, the register writes of each sensor, the edges of the LEDs, and the pace
    of all these. Exit code 0: no difference, 1: some, 2: wrong use, 3: both failed alike, 4: not comparable.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_run

    isolated, limit = limits_of_run(limit, isolate)
    if isolated is not None:
        return in_worker(context.obj, isolated)

    from fcu_emulator.emulator.cli.diff import DiffOptions, compare_firmwares

    options = DiffOptions(
        first=first,
        second=second,
        scenario=scenario,
        profile=profile,
        seed=seed,
        ideal=ideal,
        duration=duration,
        timing=timing,
        tolerance=tolerance,
        ignore=ignore,
        replay=replay,
        limit=limit,
    )
    return compare_firmwares(options)


@cli.command()
@click.argument("submissions", required=False, type=_PATH)
@click.option("--rubric", required=True, metavar="NAME|FILE", help="What is judged, such as lab3.")
@click.option("--out", type=_PATH, metavar="DIR", help="Where the reports go.")
@click.option("--roster", type=_PATH, metavar="FILE", help="The class: CSV with id, name, email.")
@click.option(
    "--overrides", type=_PATH, metavar="FILE", help="Your own points: CSV with id, what, points, comment."
)
@click.option(
    "--deadline",
    type=click.DateTime(["%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S"]),
    metavar="TIME",
    help="Say who is late, and by how much; such as 2026-11-20T23:59, local time.",
)
@click.option("--only", type=_PATH, metavar="FILE", help="Grade only the students of this CSV, again.")
@click.option(
    "--salt", type=_PATH, metavar="FILE", help="Secret that draws the boards. Default: DIR/kept/salt.key."
)
@click.option("--jobs", type=click.IntRange(1, 1024), help="Processes on this machine. Default: one a core.")
@click.option("--dask", metavar="ADDRESS", help="Judge on a cluster: its scheduler, such as tcp://host:8786.")
@click.option(
    "--take",
    type=click.Choice(["source", "firmware"]),
    help="Only source, or only built files. Default: source, else a built file.",
)
@click.option(
    "--bus",
    type=click.Choice(["I2C2", "SPI2"]),
    default="I2C2",
    show_default=True,
    help="What source is built for.",
)
@click.option(
    "--build-without-sandbox",
    is_flag=True,
    help="Let the compiler read this machine's files: for submissions that you trust.",
)
@click.option("--anonymous", is_flag=True, help="Reports without names, under pseudonyms.")
@click.option(
    "--before-due-date", is_flag=True, help="Students' pages without checks for after the due date."
)
@click.option(
    "--gradescope", is_flag=True, help="Be the autograder: judge one submission as Gradescope laid it out."
)
@click.option(
    "--autograder",
    type=_PATH,
    default="/autograder",
    show_default=True,
    metavar="DIR",
    help="With --gradescope: its folder.",
)
@click.option(
    "--gradescope-zip", type=_PATH, metavar="FILE", help="Write the autograder for Gradescope; grade nothing."
)
@click.option(
    "--wheel", type=_PATH, metavar="FILE", help="With --gradescope-zip: a wheel of this version to put in."
)
def grade(gradescope: bool, autograder: Path, **options: Any) -> ExitCode:
    """Judge the programs of a class by a rubric, and write reports.

    SUBMISSIONS is a folder (or its zip file) with an entry for each student: a folder, a zip file, main.c or
    a built file. What was judged before is not judged again, so an interrupted run goes on with the same
    command. Exit code 0: all are judged, or cannot be for a reason in the reports; 4: some could not be
    judged through no fault of theirs.
    """
    from fcu_emulator.emulator.cli.grade import GradeOptions
    from fcu_emulator.emulator.cli.grade import grade as grade_class

    return grade_class(GradeOptions(autograder=autograder if gradescope else None, **options))


@cli.command()
@click.argument("firmware", required=False)
@click.option("--scenario", metavar="NAME|FILE", help="Play it from the start, and judge the firmware.")
@click.option("--profile", help="How the sensors are wired: lab3 or fcu001v1. Default: as the firmware says.")
@click.option(
    "--seed", type=int, help="Which board of the class, and its noise. Default: the scenario's, or 0."
)
@click.option("--ideal", is_flag=True, help="Sensors without noise, offset or scale error.")
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    metavar="PORT",
    help="The page's port. Default: any free one.",
)
@click.option(
    "--listen",
    default="127.0.0.1",
    metavar="ADDRESS",
    help="Serve the page on this address of the machine, for a phone. Default: 127.0.0.1.",
)
@click.option("--no-browser", is_flag=True, help="Do not open the page, only print its address.")
@click.option(
    "--record", type=click.Path(path_type=Path), help="Save what is done to the board as a scenario (TOML)."
)
@click.option("--duration", metavar="TIME", help="End after this much virtual time, such as 1h.")
@click.option(
    "--serial", multiple=True, metavar="LINK", help="Share the terminal, as of fcu run; may be repeated."
)
@click.option(
    "--gdb",
    type=click.IntRange(0, 65535),
    metavar="PORT",
    help="Let gdb debug the firmware, on this port of 127.0.0.1 (0: any free one).",
)
@click.option("--halt", is_flag=True, help="With --gdb: wait for gdb before the first instruction.")
@_LIMIT_OF_PROCESS
@_ISOLATE
@click.pass_context
def web(
    context: click.Context,
    firmware: str | None,
    scenario: str | None,
    profile: str | None,
    seed: int | None,
    ideal: bool,
    port: int,
    listen: str,
    no_browser: bool,
    record: Path | None,
    duration: str | None,
    serial: tuple[str, ...],
    gdb: int | None,
    halt: bool,
    limit: tuple[str, ...],
    isolate: bool,
) -> ExitCode:
    """Show the board live in the browser: hold it, see it, plot it.

    FIRMWARE is what fcu run takes. A file is loaded again whenever it changes. Ctrl-C ends it.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_process

    isolated = limits_of_process(limit, isolate)
    if isolated is not None:
        return in_worker(context.obj, isolated)

    from fcu_emulator.emulator.cli.web import WebOptions, serve_board

    options = WebOptions(
        firmware,
        scenario,
        profile,
        seed,
        ideal,
        port,
        not no_browser,
        record,
        duration,
        serial,
        gdb,
        halt,
        listen,
    )
    return serve_board(options)


@cli.command()
@click.argument("directory", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "--bus",
    type=click.Choice(["I2C2", "SPI2"]),
    default="I2C2",
    show_default=True,
    help="Where the sensors are: I2C2 in the lab, SPI2 on the real board.",
)
@click.option("--rubric", metavar="NAME|FILE", help="What fcu check asks in this project, if not LAB3.")
def new(directory: Path, bus: str, rubric: str | None) -> None:
    """Start a LAB3 program in C in the new folder DIR."""
    from fcu_emulator.emulator.cli.new import create_project

    create_project(directory, bus, rubric)


@cli.command(short_help="Build a project of fcu new, without make.")
@click.argument("folder", default=".", type=click.Path(path_type=Path, file_okay=False))
def build(folder: Path) -> None:
    """Build lab3.elf in FOLDER, a project of `fcu new`; without it, in the folder you are in.

    Gives the same file as make, which is not needed. The compiler may be on the PATH, or in the folder of
    STM32CubeIDE, of Arm's installer, of xPack or of PlatformIO.
    """
    from fcu_emulator.emulator.cli.build import build_and_say

    build_and_say(folder)


@cli.command(short_help="Say which exercises are done, and what to do next.")
@click.argument("target", metavar="[FOLDER|FILE]", default=".")
@click.option("--exercise", "-e", multiple=True, metavar="N", help="Only this one; may be repeated.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Which board of the class, and motion.",
)
@click.option("--boards", type=click.IntRange(1, 1000), metavar="N", help="On N boards, with a summary.")
@click.option("--rubric", metavar="NAME|FILE", help="What is asked: that of the project, else lab3.")
@click.option("--json", type=click.Path(path_type=Path), help="Write what is shown to a JSON file as well.")
@click.option(
    "--save",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Save the motions as scenarios, for fcu run --scenario.",
)
@click.option("--hint", count=True, help="Show the next, more explicit hint; repeat it for the one after.")
@_LIMIT_OF_PROCESS
@_ISOLATE
@click.pass_context
def check(
    context: click.Context,
    target: str,
    exercise: tuple[str, ...],
    seed: int,
    boards: int | None,
    rubric: str | None,
    json: Path | None,
    save: Path | None,
    hint: int,
    limit: tuple[str, ...],
    isolate: bool,
) -> ExitCode:
    """Say which exercises are done, what is wrong with the next one, and what to do.

    FOLDER is a project of `fcu new`, which is built first; without it, the one you are in. FILE is an ELF,
    HEX or BIN file, or a firmware's name. Exit code 0: all is right, 1: something is not, 2: it does not
    build or cannot be used, 3: it crashed or hung, 4: something could not be judged.
    """
    from fcu_emulator.emulator.cli.isolated import in_worker, limits_of_process

    isolated = limits_of_process(limit, isolate)
    if isolated is not None:
        return in_worker(context.obj, isolated)

    from fcu_emulator.emulator.cli.check import CheckOptions, check_program

    return check_program(CheckOptions(target, rubric, exercise, seed, json, save, hint, boards))


@cli.command(short_help="List the scenarios, and the question that each asks.")
def scenarios() -> None:
    """List the scenarios that come with fcu, and the question each asks."""
    from fcu_emulator.emulator.cli.listings import list_scenarios

    list_scenarios()


@cli.group()
def scenario() -> None:
    """Work on scenario files."""


@scenario.command("check")
@click.argument("file")
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
    """Work on rubrics: files that say how programs are judged."""


@rubric.command("check")
@click.argument("file")
@click.option("--file-only", is_flag=True, help="Judge no programs, only check the file.")
def check_rubric_file(file: str, file_only: bool) -> None:
    """Check a rubric FILE, and show the points that it gives away."""
    from fcu_emulator.emulator.cli.rubric_check import check_rubric

    check_rubric(file, not file_only)


@rubric.command("schema")
def rubric_schema() -> None:
    """Print the JSON schema of rubrics, for an editor's completion."""
    from fcu_emulator.emulator.cli.listings import print_rubric_schema

    print_rubric_schema()


@cli.command(short_help="Print the register map of a sensor or a block of the chip.")
@click.argument("part", required=False)
@click.option("--fidelity", is_flag=True, help="Instead, say what is modelled of each part, and how.")
def registers(part: str | None, fidelity: bool) -> None:
    """Print the register map of PART: a sensor (LSM6DSL) or a block of the chip (TIM9), with meanings."""
    from fcu_emulator.emulator.cli.listings import print_fidelity, print_registers

    if fidelity:
        print_fidelity()
    else:
        print_registers(part)


@cli.command(short_help="Say what works on this machine, and what to install.")
def doctor() -> ExitCode:
    """Say what works on this machine, and what to install for the rest."""
    from fcu_emulator.emulator.cli.doctor import examine

    return ExitCode.HELD if examine() else ExitCode.WRONG_USE
