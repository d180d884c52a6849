"""``fcu web``: serve a live board and its page, until Ctrl-C."""

from __future__ import annotations

import math
import threading
import webbrowser
from contextlib import ExitStack

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.isolated import announcement
from fcu_emulator.emulator.cli.options import WebOptions
from fcu_emulator.emulator.cli.run import interruptible
from fcu_emulator.emulator.cli.screen import say
from fcu_emulator.emulator.clock import PS_PER_S, parse_duration
from fcu_emulator.emulator.errors import InputError, LinkError
from fcu_emulator.emulator.host.isolation import limits_of_worker
from fcu_emulator.emulator.links import Addressed, ByteLink, open_link
from fcu_emulator.emulator.links.control import ControlServer
from fcu_emulator.emulator.live.exercises import Exercises
from fcu_emulator.emulator.live.listening import warning
from fcu_emulator.emulator.live.public import given_token
from fcu_emulator.emulator.live.server import PageServer
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup


def serve_board(options: WebOptions) -> ExitCode:
    """Serve a board until the user ends it. Raises FcuError."""
    if options.halt and options.gdb is None:
        raise InputError("--halt must be used with --gdb PORT, such as --gdb 3333")
    setup = Setup(
        options.firmware,
        options.scenario,
        options.wiring,
        options.seed,
        options.ideal,
        gdb=options.gdb,
        halt=options.halt,
    )
    if options.record is not None and not options.record.absolute().parent.is_dir():
        raise InputError(f"--record {options.record}: the folder {options.record.parent} must exist")
    if options.record is not None and (options.record.is_dir() or options.record.is_fifo()):
        raise InputError(f"--record {options.record} must be a writable file")
    token = given_token()
    with ExitStack() as stack:
        server = PageServer(
            options.port,
            say,
            listen=options.listen,
            base_path=options.base_path,
            behind=options.behind,
            token=token,
        )
        stack.callback(server.close)
        links: list[ByteLink] = []
        for spec in dict.fromkeys(options.serial):
            links.append(open_link(spec, say=say))
            stack.callback(links[-1].close)
        exercises = _exercises(options.firmware)
        session = LiveSession(setup, server.publish, options.record, links=links, exercises=exercises)
        session.end_s = _end_s(options.duration)
        server.controls = session
        booted = session.board.booted
        what = f", scenario {options.scenario}" if options.scenario else ""
        say(f"board {booted.wiring.name}, firmware {booted.name}{what}, seed {session.board.seed}")
        for note in (*booted.notes, *announcement()):
            say(note)
        say(f"page: {server.url if token is None else server.address.page_without_token}")
        if warned := warning(options.listen):
            say(warned, "warning")
        for line in session.ways():
            say(line)
        session.control = _control_server(session, links, stack)
        if not options.no_browser and limits_of_worker() is None:  # a browser would inherit the limits
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
        with interruptible(session) as ended:
            say("Ctrl-C ends it")
            session.run()
        if ended:
            say(f"ended by {ended[0]} at {session.board.now_s:.3f} s of virtual time")
        for line in session.verdict():
            say(line)
        if options.record is not None:
            say(f"the actions are saved in {options.record}")
    return ExitCode.PASSED


def _exercises(firmware: str | None) -> Exercises | None:
    """Return the exercises of the project, or None without a usable rubric."""
    from fcu_emulator.emulator.cli.exercises import (
        LabExercises,  # slow: loads all of grading
    )
    from fcu_emulator.emulator.grading.rubric import rubric_of

    try:
        return LabExercises(rubric_of(firmware or ""))
    except InputError as error:
        say(f"the page cannot show exercises: {error}")
        return None


def _control_server(session: LiveSession, links: list[ByteLink], stack: ExitStack) -> ControlServer | None:
    serial = [link.address for link in links if isinstance(link, Addressed)]
    try:
        control = ControlServer(session.board.booted.name, serial, session.answer)
    except LinkError as error:
        say(f"fcu move and fcu terminal cannot find this board: {error}")
        return None
    stack.callback(control.close)
    return control


def _end_s(text: str | None) -> float:
    if text is None:
        return math.inf
    try:
        return parse_duration(text) / PS_PER_S
    except ValueError as error:
        raise InputError(f"--duration {error}") from error
