"""Options of commands that have more than three options."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import click

from fcu_emulator.emulator.cli.completion import FIRMWARE, RUBRIC, SCENARIO, WIRING
from fcu_emulator.emulator.cli.declare import argument, option

PATH = click.Path(path_type=Path)
BUS = click.Choice(["I2C2", "SPI2"])
GESTURES = ("lift", "tap", "shake", "free_fall", "figure_eight", "turn_over", "pass_magnet", "flat")

Ignorable: TypeAlias = Literal["time", "numbers", "registers", "leds"]
"""Copy from ``analysis.compare``. ``fcu --help`` must not load this module."""
SubmissionType: TypeAlias = Literal["source", "firmware"]
"""Copy from ``grading.submissions``."""

# -- Options of several commands ----------------------------------------------------------------------------


def _wiring() -> Any:
    return option(
        "--wiring",
        renamed_from="--profile",
        shell_complete=WIRING,
        help="Wiring of the sensors: lab3 or fcu001v1. Default: the wiring for which the firmware was built.",
    )


def _seed() -> Any:
    return option(
        "--seed",
        type=int,
        help="Random seed: selects the board's offsets and noise. Default: the seed of the scenario, or 0.",
    )


def _ideal() -> Any:
    return option("--ideal", is_flag=True, help="Sensors without noise, offset or scale error.")


def _gdb() -> Any:
    return option(
        "--gdb",
        type=click.IntRange(0, 65535),
        metavar="PORT",
        help="Serve gdb on this port of 127.0.0.1 (0: any free port).",
    )


def _halt() -> Any:
    return option("--halt", is_flag=True, help="With --gdb: wait for gdb before the first instruction.")


def _isolate() -> Any:
    return option(
        "--isolate",
        is_flag=True,
        help="Run in a separate process with limits on memory, CPU time and files.",
    )


def _limit(help_text: str) -> Any:
    return option("--limit", multiple=True, metavar="NAME=NUMBER", help=f"{help_text}; may be repeated.")


def _limit_of_process() -> Any:
    return _limit("With --isolate: set a limit of the process, for example cpu_s=600")


def _file(help_text: str, *names: str) -> Any:
    return option(*names, type=PATH, metavar="FILE", help=help_text)


# -- Options of a single command ----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Arguments of ``fcu run``."""

    firmware: str | None = argument(required=False, shell_complete=FIRMWARE)
    wiring: str | None = _wiring()
    scenario: str | None = option(
        "--scenario",
        shell_complete=SCENARIO,
        metavar="NAME|FILE",
        help="Move the board, and check the firmware's output.",
    )
    duration: str | None = option(
        "--duration", metavar="TIME", help="Virtual time to run, such as 10s or 500ms."
    )
    speed: str | None = option(
        "--speed",
        metavar="FACTOR|max",
        help="Ratio of virtual to wall time, or max. Default: 1 with a terminal.",
    )
    serial: tuple[str, ...] = option(
        "--serial",
        multiple=True,
        default=("stdout",),
        metavar="LINK",
        help="stdout (default), port, pty[:LINK], tcp[:PORT], rfc2217[:PORT] or file:PATH; may be repeated.",
    )
    seed: int | None = _seed()
    boards: int | None = option(
        "--boards",
        type=click.IntRange(1, 1000),
        metavar="N",
        help="With --scenario: run on N boards, with a summary.",
    )
    ideal: bool = _ideal()
    crystal: float | None = option(
        "--crystal",
        type=click.FloatRange(4, 26),
        metavar="MHZ",
        help="Frequency of the chip's crystal, for a program of another board. Default: as in the scenario, else 16.",
    )
    flash: Path | None = _file(
        "Keep the chip's flash in FILE between runs, except the sectors of the program.", "--flash"
    )
    trace: Path | None = _file("Write every event to a JSON-lines file.", "--trace")
    vcd: Path | None = _file("Write the signals on the board's wires, for logic analysers.", "--vcd")
    perfetto: Path | None = _file("Write a timeline of functions, buses and LEDs.", "--perfetto")
    quiet: bool = option("--quiet", "-q", is_flag=True, help="Print only a scenario's verdict to stderr.")
    gdb: int | None = _gdb()
    halt: bool = _halt()
    limit: tuple[str, ...] = _limit("Set a resource limit, for example wall_s=60")
    json: Path | None = _file("Write the whole summary to a JSON file.", "--json")
    verbose: bool = option(
        "--verbose",
        is_flag=True,
        renamed_from="--notes",
        help="Show all notes at the end, including those that correct programs cause.",
    )
    all_uarts: bool = option(
        "--all-uarts", is_flag=True, help="Show the output of USARTs without a terminal at the end."
    )
    isolate: bool = _isolate()


@dataclass(frozen=True, kw_only=True)
class MoveOptions:
    """Arguments of ``fcu move``. None means that an angle does not change."""

    gesture: str | None = argument(
        required=False,
        type=click.Choice([*GESTURES, "fall", "eight", "over", "magnet", "reset"]),
        metavar=f"[{'|'.join(GESTURES)}]",
    )
    amount: float | None = argument(type=float, required=False)
    roll: float | None = option(
        "--roll", type=float, metavar="DEG", help="Turn to this angle; the other angles do not change."
    )
    pitch: float | None = option("--pitch", type=float, metavar="DEG")
    yaw: float | None = option("--yaw", type=float, metavar="DEG")
    north: float | None = option(
        "--north", type=float, metavar="METRES", help="Push the board north by this distance."
    )
    east: float | None = option("--east", type=float, metavar="METRES")
    up: float | None = option("--up", type=float, metavar="METRES")
    duration: str | None = option(
        "--for",
        metavar="TIME",
        help="Duration, such as 1s. Default: the usual duration of this motion by hand.",
    )
    axis: str | None = option(
        "--axis", type=click.Choice(["north", "west", "up"]), help="Direction of tap and shake."
    )
    board: str | None = option("--board", metavar="PROCESS", help="Process id of the board, if several run.")


@dataclass(frozen=True, kw_only=True)
class DiffOptions:
    """Arguments of ``fcu diff``."""

    first: str = argument(metavar="A", shell_complete=FIRMWARE)
    second: str = argument(metavar="B", shell_complete=FIRMWARE)
    scenario: str = option(
        "--scenario",
        shell_complete=SCENARIO,
        metavar="NAME|FILE",
        required=True,
        help="Scenario of both runs.",
    )
    wiring: str | None = _wiring()
    seed: int | None = _seed()
    ideal: bool = _ideal()
    duration: str | None = option(
        "--duration", metavar="TIME", help="Virtual time to compare. Default: the duration of the scenario."
    )
    time_tolerance: str = option(
        "--time-tolerance",
        renamed_from="--timing",
        metavar="TIME",
        default="20ms",
        show_default=True,
        help="Largest accepted difference between the times of an event.",
    )
    tolerance: tuple[str, ...] = option(
        "--tolerance",
        multiple=True,
        metavar="FIELD=NUMBER",
        help="Largest accepted difference of a number, such as ACC=0.5; may be repeated.",
    )
    ignore: tuple[Ignorable, ...] = option(
        "--ignore",
        multiple=True,
        type=click.Choice(get_args(Ignorable)),
        help="Do not compare the time between entries, the numbers in printed lines, the register writes or the "
        "LEDs' edges; may be repeated.",
    )
    replay: bool = option("--replay", is_flag=True, help="Give A (lab3 or template) the samples that B read.")
    limit: tuple[str, ...] = _limit("Set a resource limit of each run, for example wall_s=60")
    isolate: bool = _isolate()


@dataclass(frozen=True, kw_only=True)
class GradeOptions:
    """Arguments of ``fcu grade``."""

    submissions: Path | None = argument(required=False, type=PATH)
    rubric: str = option(
        "--rubric",
        shell_complete=RUBRIC,
        required=True,
        metavar="NAME|FILE",
        help="The rubric, such as lab3.",
    )
    out: Path | None = option("--out", type=PATH, metavar="DIR", help="Folder for the reports.")
    roster: Path | None = _file("The class: CSV with id, name, email.", "--roster")
    overrides: Path | None = _file(
        "Points that you give by hand: CSV with id, what, points, comment.", "--overrides"
    )
    deadline: datetime | None = option(
        "--deadline",
        type=click.DateTime(["%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H:%M:%S"]),
        metavar="TIME",
        help="Due date, to report late submissions; local time, such as 2026-11-20T23:59.",
    )
    only: Path | None = _file("Grade only the students of this CSV again.", "--only")
    salt: Path | None = _file(
        "File with the secret that selects the boards. Default: DIR/kept/salt.key.", "--salt"
    )
    jobs: int | None = option(
        "--jobs",
        type=click.IntRange(1, 1024),
        help="Number of processes on this machine. Default: one for each core.",
    )
    dask: str | None = option(
        "--dask",
        metavar="ADDRESS",
        help="Judge on a cluster: address of its Dask scheduler, such as tcp://host:8786.",
    )
    submission_type: SubmissionType | None = option(
        "--submission-type",
        renamed_from="--take",
        type=click.Choice(get_args(SubmissionType)),
        help="Which files to accept: only source, or only built files. Default: source if there is any, else a built file.",
    )
    bus: str = option(
        "--bus",
        type=BUS,
        default="I2C2",
        show_default=True,
        help="Bus of the sensors, for programs built from source.",
    )
    build_without_sandbox: bool = option(
        "--build-without-sandbox",
        is_flag=True,
        help="Build without a sandbox: only for submissions that you trust.",
    )
    anonymous: bool = option("--anonymous", is_flag=True, help="Reports with pseudonyms instead of names.")
    before_due_date: bool = option(
        "--before-due-date", is_flag=True, help="Omit the checks that are shown only after the due date."
    )
    gradescope: bool = option(
        "--gradescope", is_flag=True, help="Judge one submission in the folders of Gradescope's autograder."
    )
    autograder: Path = option(
        "--autograder",
        type=PATH,
        default=Path("/autograder"),
        show_default=True,
        metavar="DIR",
        help="With --gradescope: folder of the autograder.",
    )
    gradescope_zip: Path | None = _file(
        "Write the autograder for Gradescope; grade nothing.", "--gradescope-zip"
    )
    wheel: Path | None = _file("With --gradescope-zip: the wheel of this version to include.", "--wheel")


@dataclass(frozen=True, kw_only=True)
class WebOptions:
    """Arguments of ``fcu web``."""

    firmware: str | None = argument(required=False, shell_complete=FIRMWARE)
    scenario: str | None = option(
        "--scenario",
        shell_complete=SCENARIO,
        metavar="NAME|FILE",
        help="Play this scenario from the start, and check the firmware.",
    )
    wiring: str | None = _wiring()
    seed: int | None = _seed()
    ideal: bool = _ideal()
    port: int = option(
        "--port",
        type=click.IntRange(0, 65535),
        default=0,
        metavar="PORT",
        help="Port of the page. Default: any free port.",
    )
    listen: str = option(
        "--listen",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="Address of the page, for example for a phone. Default: 127.0.0.1.",
    )
    base_path: str = option(
        "--base-path",
        default="/",
        metavar="PATH",
        help="Path prefix of the page behind a proxy, such as /user/ada/fcu/. Default: /.",
    )
    behind: str | None = option(
        "--behind",
        metavar="ORIGIN",
        help="Origin of the proxy in front of the page, such as https://hub.example.",
    )
    no_browser: bool = option(
        "--no-browser", is_flag=True, help="Print the page's address without opening it."
    )
    record: Path | None = _file("Save each action on the board as a scenario (TOML).", "--record")
    duration: str | None = option(
        "--duration", metavar="TIME", help="End after this virtual time, such as 1h."
    )
    serial: tuple[str, ...] = option(
        "--serial",
        multiple=True,
        metavar="LINK",
        help="Share the terminal, as with fcu run; may be repeated.",
    )
    gdb: int | None = _gdb()
    halt: bool = _halt()
    limit: tuple[str, ...] = _limit_of_process()
    isolate: bool = _isolate()


@dataclass(frozen=True, kw_only=True)
class CheckOptions:
    """Arguments of ``fcu check``. ``rubric``: None selects the project's rubric, or else LAB3's."""

    target: str = argument(metavar="[FOLDER|FILE]", default=".", shell_complete=FIRMWARE)
    exercises: tuple[str, ...] = option(
        "--exercise", "-e", multiple=True, metavar="N", help="Check only this exercise; may be repeated."
    )
    seed: int = option(
        "--seed",
        type=click.IntRange(0),
        default=0,
        show_default=True,
        help="Random seed: selects the board and its motions.",
    )
    boards: int | None = option(
        "--boards", type=click.IntRange(1, 1000), metavar="N", help="Check on N boards, with a summary."
    )
    rubric: str | None = option(
        "--rubric",
        shell_complete=RUBRIC,
        metavar="NAME|FILE",
        help="The rubric. Default: the rubric of the project, else lab3.",
    )
    jobs: int | None = option(
        "--jobs",
        type=click.IntRange(1, 1024),
        metavar="N",
        help="Number of processes for the runs. Default: one for each core.",
    )
    json: Path | None = _file("Write the result also to a JSON file.", "--json")
    junit: Path | None = _file("Write the checks also to a JUnit file, for CI.", "--junit")
    annotations: str | None = option(
        "--annotations",
        type=click.Choice(["github"]),
        help="Show failed checks at their source lines in GitHub Actions.",
    )
    save: Path | None = option(
        "--save",
        type=click.Path(path_type=Path, file_okay=False),
        metavar="DIR",
        help="Save the motions as scenarios, for fcu run --scenario.",
    )
    hints: int = option(
        "--hint",
        count=True,
        help="Show a more explicit hint for each failure; repeat for the next one.",
    )
    limit: tuple[str, ...] = _limit_of_process()
    isolate: bool = _isolate()
