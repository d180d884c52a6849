"""Session of a board in real time.

One thread runs the session and owns the board. The thread calls ``publish``, which must not block.

Decision: if a command changes the board, it becomes an event of the virtual clock, one picosecond
after the time at which the board has stopped. The event's time is recorded, so that a replay does
not depend on the run's slices.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.errors import FcuError, FirmwareError, InputError, failure_text
from fcu_emulator.emulator.links import ByteLink
from fcu_emulator.emulator.live import messages, registers, view
from fcu_emulator.emulator.live.broadcast import Broadcast, Publish
from fcu_emulator.emulator.live.control import answer_message
from fcu_emulator.emulator.live.exercises import Exercises
from fcu_emulator.emulator.live.files import FileWatch, UploadedFile
from fcu_emulator.emulator.live.messages import PageCommand
from fcu_emulator.emulator.live.recording import SessionRecording
from fcu_emulator.emulator.live.setup import Setup, pose_entries
from fcu_emulator.emulator.scenario import scenario_names
from fcu_emulator.emulator.scenario.timeline import TimelineAction
from fcu_emulator.emulator.scenario.toml_writer import parse_entry

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
    from fcu_emulator.emulator.chip.gdb.server import GdbServer
    from fcu_emulator.emulator.links.control import ControlServer

# Wall time, s:
_SLICE_S = 0.02  # wall time of a slice of the run; a command shortens it
_STANDING_S = 0.1  # longest wait of a paused board
_WATCH_S = 0.2  # time between two checks of the firmware's file
_LAG_FORGIVEN_S = 0.25  # a board with a longer delay than this does not try to catch up
_STEP_WALL_S = 5.0  # longest wall time of one step
# Virtual time: longest duration of one step, and the time between two checks for the step's end
_STEP_PS = {"second": PS_PER_S, "line": 10 * PS_PER_S, "tick": PS_PER_S}
_STEP_SLICE_PS = {"second": 10 * PS_PER_MS, "line": PS_PER_MS, "tick": PS_PER_MS // 20}

_TYPED_AHEAD = 2048  # maximum number of a link's bytes that wait for the board
_MOST_WAITING = 1000  # commands
_MOST_UPLOADS = 2  # number of uploads that wait, each with up to 11 MiB


class LiveSession:
    """Runner of a session's boards, one after another, with pacing and commands.

    Raises FcuError if the first board cannot be created. ``record``: scenario file of the session,
    written at the end and at each power-on.
    """

    setup: Setup
    board: Board
    recording: SessionRecording
    _broadcast: Broadcast
    _file: FileWatch | None
    _slice_s: float
    _carried: int

    def __init__(
        self,
        setup: Setup,
        publish: Publish,
        record: Path | None = None,
        wall_clock_s: Callable[[], float] = time.monotonic,
        wait: Callable[[threading.Event, float], object] = threading.Event.wait,
        links: Sequence[ByteLink] = (),
        exercises: Exercises | None = None,
    ) -> None:
        self._publish = publish
        self.control: ControlServer | None = None
        """Control server for other programs. The caller that sets it must close it."""
        self._debugger: GdbServer | None = None
        self._halted = False
        self._record = record
        self._wall_s = wall_clock_s
        self._wait_for = wait
        self._links = links
        self._exercises = exercises
        self._checked: dict[str, messages.Checked] = {}
        self._commands: deque[tuple[object, PageCommand]] = deque()
        self._wake = threading.Event()
        self._clients: dict[object, messages.Watch] = {}
        self._uploaded: UploadedFile | None = None
        self.stopped = False
        self.end_s = math.inf
        """Virtual time since power-on at which the run ends."""
        self.speed: float | None = 1.0
        self.state = "running"
        self.problem = ""
        self.run_number = 0
        self._told = ""
        self._begin(setup)

    # -- called from any thread -------------------------------------------------------------------------

    def post(self, client: object, command: PageCommand) -> bool:
        if len(self._commands) >= _MOST_WAITING:
            return False
        if isinstance(command, messages.Upload) and self._uploads_waiting() >= _MOST_UPLOADS:
            return False
        self._commands.append((client, command))
        self._wake.set()
        return True

    def _uploads_waiting(self) -> int:
        return sum(isinstance(command, messages.Upload) for _, command in tuple(self._commands))

    def attach(self, client: object) -> None:
        self._commands.append((client, _Attach()))
        self._wake.set()

    def detach(self, client: object) -> None:
        self._commands.append((client, _Detach()))
        self._wake.set()

    def stop(self) -> None:
        """End the run soon. Signal handlers may call this."""
        self.stopped = True
        self._wake.set()

    # -- the loop ---------------------------------------------------------------------------------------

    def run(self) -> None:
        """Run until :meth:`stop`. Raises OutputError, and reports other failures to the pages."""
        with ExitStack() as stack:
            for close in (
                self._remove_upload,
                self._close_board,
                self._close_debugger,
                self._close_exercises,
                self.save,
            ):
                stack.callback(close)  # the latest callback runs first
            while not self.stopped and self.board.now_s < self.end_s:
                self._advance()
                self._guard(self._serve_links)
                if self.control is not None:
                    self._guard(self.control.serve)
                self._take_commands()
                self._guard(self._follow_file)
                self._guard(self._publish_checked)
                self._guard(self._show)
                self._wait()

    def _guard(self, action: Callable[[], object], client: object | None = None) -> None:
        """Run an action, and report errors to ``client``, or to all clients if None."""
        try:
            action()
        except FirmwareError as error:
            self._fail(str(error))
        except Exception as error:
            notice = messages.failure(error)
            if client is not None or notice.text != self._told:  # do not repeat a text in each cycle
                self._publish(notice, client)
            self._told = notice.text if client is None else self._told

    def _show(self) -> None:
        self._broadcast.show(self._wall_s(), self.state == "running")

    def _close_exercises(self) -> None:
        if self._exercises is not None:
            self._exercises.close()

    def _close_debugger(self) -> None:
        if self._debugger is not None:
            self._debugger.close()

    def _close_board(self) -> None:
        self.board.close()

    def _remove_upload(self) -> None:
        if self._uploaded is not None:
            self._uploaded.remove()

    def save(self) -> None:
        if self._record is not None:
            self.recording.save(self._record)

    def _serve_links(self) -> None:
        terminal = self.board.terminal
        if not self._links:
            return
        printed, self._carried = terminal.since(self._carried)
        for link in self._links:
            if printed:
                link.send(printed)
            room = _TYPED_AHEAD - terminal.typing_left
            takes = room > 0 and self.state == "running" and not self._halted
            typed = link.receive(room) if takes else b""
            if typed:
                self._perform(parse_entry({"do": "send", "hex": typed.hex()}))

    def _wait(self) -> None:
        pause_s = self._pause_s()
        if pause_s > 0.0:
            self._wait_for(self._wake, pause_s)
        self._wake.clear()

    def _pause_s(self) -> float:
        """Return the wall time until the next slice or frame."""
        running = self.state == "running"
        if running and self.speed is None:
            return 0.0
        wall_s, pause_s = self._wall_s(), _STANDING_S
        if running:
            pause_s = min(self._due_wall_s(self.board.now_s) + _SLICE_S - wall_s, _SLICE_S)
        return min(pause_s, self._broadcast.frame_in_s(wall_s))

    def _due_wall_s(self, virtual_s: float) -> float:
        assert self.speed is not None
        return self._origin_wall_s + (virtual_s - self._origin_s) / self.speed

    def _advance(self) -> None:
        """Run the board up to the present wall time. If the machine is too slow, the board does not catch up."""
        if self.state != "running":
            if self._debugger is not None:
                self._guard(partial(self._run_debugged, self._debugger, self.board.clock.now_ps))
            return
        now_s, wall_s = self.board.now_s, self._wall_s()
        if self.speed is None:
            target_s = now_s + self._slice_s
        else:
            if wall_s - self._due_wall_s(now_s) > _LAG_FORGIVEN_S:
                self._set_origin()
            target_s = self._origin_s + (wall_s - self._origin_wall_s) * self.speed
            target_s = min(target_s, now_s + self._slice_s)
        if target_s <= now_s:
            return
        self._run_until(round(target_s * PS_PER_S))
        took_s = self._wall_s() - wall_s
        factor = 0.5 if took_s > 4 * _SLICE_S else 1.5
        longest_s = 0.25 if self.speed is None else 4 * _SLICE_S * max(self.speed, 0.01)
        self._slice_s = min(max(self._slice_s * factor, 1e-5), longest_s)

    def _run_until(self, at_ps: int) -> None:
        try:
            if self._debugger is not None:
                self._run_debugged(self._debugger, at_ps)
            elif at_ps > self.board.clock.now_ps:
                self.board.run_until_ps(at_ps)
        except Exception as error:  # failures of the firmware, of a disturbed scenario, or of the machine
            self._fail(failure_text(error))
        self._broadcast.changed = True

    def _run_debugged(self, debugger: GdbServer, at_ps: int) -> None:
        debugger.run_until_ps(at_ps)
        self.stopped |= debugger.killed
        if debugger.halted != self._halted:
            self._halted = debugger.halted
            self._set_state(self.state)

    def _fail(self, problem: str) -> None:
        self.state, self.problem = "failed", problem
        self._guard(self._broadcast.show_text)  # the text must come before the status, which marks the end
        self._guard(self._say_status)
        self._guard(self._broadcast.publish_findings)

    def _set_origin(self) -> None:
        self._origin_wall_s, self._origin_s = self._wall_s(), self.board.now_s

    # -- power-on ---------------------------------------------------------------------------------------

    def _begin(self, setup: Setup, hold: bool = False) -> None:
        """Power on a new board. ``hold`` keeps the previous position. Raises FcuError."""
        if self._debugger is not None and setup.gdb is not None:
            setup = replace(setup, gdb=self._debugger.port, halt=False)
        board = setup.power_on()
        held = []
        if hold and setup.scenario is None and self.setup.scenario is None:
            held = pose_entries(self.board)
        is_first = not self.run_number
        if not is_first:
            self.save()
            self._broadcast.close()
            self._close_debugger()
            self.board.close()
        self.setup, self.board = setup, board
        self._debugger, self._halted = None, False
        if is_first:
            self._debug(board)
        elif board.chip is not None:
            self._guard(lambda: self._debug(board))  # another program may be using the debugger's port now
        self.recording = SessionRecording(board, setup.ideal)
        self.run_number += 1
        self._set_origin()
        self._broadcast = Broadcast(board, self.run_number, self._publish, self._clients, self._origin_wall_s)
        self._show_checked()
        self._file = setup.watched()
        self._slice_s = _SLICE_S
        self._carried = 0
        self._full = False
        self._last_ps = 0
        self._next_watch_s = 0.0
        if self.state == "failed":
            self.state = "running"
        self.problem = ""
        for entry in held:
            self._guard(partial(self._perform, self._entry(entry)))

    def _debug(self, board: Board) -> None:
        self._debugger = self.setup.debugger(board)
        self._halted = self._debugger is not None and self._debugger.halted

    def _again(self, setup: Setup, why: str, hold: bool = True, loaded: bool = False) -> None:
        """Power on with another firmware or scenario. On failure, report the failure and keep the board."""
        try:
            self._begin(setup, hold)
        except Exception as error:
            self._publish(messages.failure(error), None)
            return
        if loaded:
            self._checked = {name: replace(one, outdated=True) for name, one in self._checked.items()}
            self._show_checked()
        for client in self._clients:
            self._greet(client)
        self._publish(messages.Notice("info", why), None)

    # -- commands ---------------------------------------------------------------------------------------

    def _take_commands(self) -> None:
        for _ in range(len(self._commands)):
            client, command = self._commands.popleft()
            self._guard(partial(self._execute, client, command), client)

    def _execute(self, client: object, command: PageCommand) -> None:  # noqa: PLR0912 one case for each command
        self._broadcast.changed = True
        match command:
            case messages.Do(entry=entry, id=number):
                self._perform(self._entry(entry))
                self._broadcast.answer(number)
            case messages.Run():
                if self.state == "paused":
                    self._set_state("running")
            case messages.Pause():
                if self.state == "running":
                    self._set_state("paused")
            case messages.StepCommand(of=of):
                self._step(of)
            case messages.Speed(factor=factor):
                self.speed = factor
                self._set_state(self.state)
            case messages.Reset():
                self._again(self.setup, "reset")
            case messages.FirmwareCommand(name=name):
                if name not in self.board.description.firmware:
                    known = ", ".join(self.board.description.firmware)
                    raise InputError(f"unknown firmware {name[:40]!r}; known: {known}")
                self._again(replace(self.setup, firmware=name), f"{name} has been loaded", loaded=True)
            case messages.Upload(name=name):
                self._take_upload(name, command.content())
            case messages.Play(scenario=scenario):
                if scenario is not None and scenario not in scenario_names():
                    raise InputError(f"unknown scenario {scenario[:40]!r}")
                firmware = self.setup.firmware
                if firmware is None:
                    firmware = self.board.booted.name or None
                self._again(replace(self.setup, scenario=scenario, firmware=firmware), "from the start")
            case messages.Watch():
                self._watch(client, command)
            case messages.RecordCommand():
                self._publish(messages.Recorded(self.recording.text()), client)
            case messages.CheckCommand(exercise=exercise):
                self._check(exercise)
            case _Attach():
                self._clients[client] = messages.Watch()
                self._greet(client)
            case _Detach():
                self._clients.pop(client, None)

    def _watch(self, client: object, watch: messages.Watch) -> None:
        known = [name for name in watch.variables if view.can_be_watched(self.board, name)]
        self._clients[client] = replace(watch, variables=known)
        self._broadcast.look_again()
        unknown = [name for name in watch.variables if name not in known]
        if unknown:
            self._publish(messages.Unknown(unknown), client)
            raise InputError(view.why_not_watched(self.board, unknown[0]))

    def _check(self, exercise: str) -> None:
        if self._exercises is None:
            raise InputError("cannot check exercises: this board has no lab")
        if callable(self.setup.firmware):
            raise InputError("cannot check exercises: the firmware must be a file or a shipped program")
        self._exercises.start(exercise, self.board.booted.name, self.setup.seed or 0)
        self._tell(messages.Checked(exercise, "checking"))

    def _publish_checked(self) -> None:
        for checked in self._exercises.finished() if self._exercises is not None else ():
            self._tell(replace(checked, outdated=self._checked[checked.exercise].outdated))

    def _tell(self, checked: messages.Checked) -> None:
        self._checked[checked.exercise] = checked
        self._publish(checked, None)
        self._show_checked()

    def _show_checked(self) -> None:
        """Show the problems that checks have found in the loaded firmware."""
        valid = (one for one in self._checked.values() if not one.outdated)
        self._broadcast.checked = [_diagnosis(cause) for one in valid for cause in one.causes]

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Answer a request of :attr:`control`. Raises InputError."""
        return answer_message(self.board, message, lambda table: self._perform(self._entry(table)))

    def _entry(self, table: Mapping[str, Any]) -> TimelineAction:
        return parse_entry(table, self.board.description)

    def _refuse_if_stopped(self) -> None:
        if self.state == "failed":
            raise InputError("the firmware has failed; reset the board, or load another firmware")
        if self._halted:
            raise InputError("gdb has stopped the board; type continue in gdb, or quit gdb")

    def _perform(self, entry: TimelineAction) -> None:
        """Perform an entry one picosecond from now. Raises InputError."""
        board = self.board
        self._refuse_if_stopped()
        if not self.recording.room and not self._full:
            self._full = True
            self._publish(
                messages.Notice("error", "the recording is full; later actions are not recorded"), None
            )
        clock = board.clock
        at_ps = max(clock.now_ps + 1, self._last_ps)
        while at_ps != self._last_ps and at_ps in (clock.next_ps, clock.deferred_ps):
            at_ps += 1  # a replay may execute events of the same time in another order
        self._last_ps = at_ps
        refused: list[FcuError] = []

        def perform() -> None:
            try:
                entry.perform(board, at_ps)
            except InputError as error:  # this failure must not end the run
                refused.append(error)

        clock.schedule(at_ps, perform)
        self._run_until(at_ps)
        if refused:
            raise refused[0]
        self.recording.add(at_ps, entry)

    def _step(self, of: str) -> None:
        self._refuse_if_stopped()
        board, began_s = self.board, self._wall_s()
        end_ps = board.clock.now_ps + _STEP_PS[of]
        ticks, position = board.timer.ticks, board.terminal.position
        while board.clock.now_ps < end_ps and self._wall_s() - began_s < _STEP_WALL_S:
            self._run_until(min(board.clock.now_ps + _STEP_SLICE_PS[of], end_ps))
            if self.state == "failed" or self._halted:
                return
            if of == "tick" and board.timer.ticks != ticks:
                break
            if of == "line":
                printed, position = board.terminal.since(position)
                if b"\n" in printed:
                    break
        self._set_state("paused")

    def _set_state(self, state: str) -> None:
        self.state = state
        self._set_origin()
        self._broadcast.measure_pace(self._origin_wall_s)
        self._say_status()

    def _follow_file(self) -> None:
        wall_s = self._wall_s()
        if wall_s >= self._next_watch_s:
            self._next_watch_s = wall_s + _WATCH_S
            if self._file is not None and self._file.changed():
                self._again(
                    self.setup, f"{self._file.path.name} has changed and was loaded again", loaded=True
                )

    def _take_upload(self, name: str, content: bytes) -> None:
        before, setup, uploaded = self._uploaded, self.setup, UploadedFile(name, content)
        self._uploaded = uploaded
        self._again(replace(setup, firmware=uploaded.path), f"{uploaded.name} has been loaded", loaded=True)
        if self.setup is setup:
            self._uploaded = before
            uploaded.remove()
        elif before is not None:
            before.remove()

    # -- status and events ------------------------------------------------------------------------------

    def ways(self) -> list[str]:
        ways = [line for link in self._links for line in link.announce()]
        if self._debugger is not None:
            waits = "; the firmware waits for gdb" if self._debugger.halted else ""
            ways.append(f"gdb: target remote 127.0.0.1:{self._debugger.port}{waits}")
        return ways

    def verdict(self) -> list[str]:
        """Return the state of the scenario's expectations. Raises InputError."""
        plan = self.board.scenario
        return plan.standing(self.board) if plan else []

    def _status(self) -> messages.StatusEvent:
        board, plan = self.board, self.board.scenario
        return messages.StatusEvent(
            run=self.run_number,
            firmware=Path(board.booted.name).name if self._uploaded is None else self._uploaded.shown(board),
            file=str(self._file.path) if self._file and self._file.exists else "",
            sources=self._file.sources() if self._file else {},
            wiring=board.booted.wiring.name,
            scenario=plan.name if plan else "",
            question=plan.question if plan else "",
            duration_s=plan.duration_s if plan else 0.0,
            state="halted" if self._halted and self.state == "running" else self.state,
            speed=self.speed,
            problem=self.problem,
            notes=list(board.booted.notes),
            variables=view.variable_names(board),
            peripherals=registers.peripheral_names(board),
            recording=str(self._record or ""),
        )

    def _say_status(self) -> None:
        self._publish(self._status(), None)

    def _greet(self, client: object) -> None:
        exercises = self._exercises.offered() if self._exercises is not None else []
        self._broadcast.greet(client, view.hello(self.board, self.ways(), exercises), self._status())
        for checked in self._checked.values():
            self._publish(checked, client)


class _Attach(PageCommand):
    """A client has connected."""


class _Detach(PageCommand):
    """A client has disconnected."""


def _diagnosis(cause: Mapping[str, Any]) -> Diagnosis:
    from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis  # slow import

    details = tuple(cause["details"])
    return Diagnosis(cause["kind"], cause["summary"], details, fatal=cause["fatal"], data=cause["data"])
