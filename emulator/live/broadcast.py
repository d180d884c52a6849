"""Events for the clients of a live board, without effect on the board."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.live import messages, pins, registers, transfers, view
from fcu_emulator.emulator.live.messages import SessionEvent
from fcu_emulator.emulator.live.past import Past
from fcu_emulator.emulator.scenario.run_view import FORMATS, TRUTH

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis

Publish = Callable[[SessionEvent, object | None], None]
"""``publish(event, client)`` sends to one client, or to all clients if ``client`` is None."""

# Wall time, s:
_FRAME_S = 0.02  # time between two frames (a State and the text before it) while something changes
_ANSWER_S = 0.005  # time from a frame to the frame that shows the effect of a command
_HEARTBEAT_S = 0.5  # added to _FRAME_S while nothing changes
_SLOWLY_S = 0.1  # time between two updates of registers and bus
_FINDINGS_S, _VERDICTS_S = 2.0, 0.5  # time between two updates of findings, and of verdicts
_FAILURE_S = 0.5  # time between two checks for stuck firmware
_UNSEEN_S = 0.1  # time between two stored states while no client is connected
_PACE_S = 1.0  # time over which the pace is measured
# Virtual time, s:
_TRUTH_S = 0.5  # maximum age of the truth; the pressure changes by about 0.002 hPa in this time

_HISTORY = 64 << 10  # bytes of terminal output that a new client receives
_LONGEST_LINE = 4096  # bytes of an incomplete line


class Broadcast:
    """Events of the session's ``run_number``-th board.

    ``clients``: the watched items of each client.
    """

    def __init__(
        self,
        board: Board,
        run_number: int,
        publish: Publish,
        clients: Mapping[object, messages.Watch],
        wall_s: float,
    ) -> None:
        self._board = board
        self._run_number = run_number
        self._publish = publish
        self._clients = clients
        self._recorder = TruthRecorder(board)
        self._transfers = transfers.Transfers(board)
        self._load = view.Load(board, self._recorder)
        self.changed = True
        """Whether the next frame would show a change."""
        self._done = 0
        self._position = 0
        self._line_rest = b""
        self._truth: dict[str, Any] = {}
        self._truth_s = 0.0
        self.checked: Sequence[Diagnosis] = ()
        """Problems of this firmware that checks of exercises have found."""
        self._findings: list[dict[str, Any]] = []
        self._verdicts = messages.Verdicts([], False)
        self._registers: dict[str, messages.RegistersEvent] = {}
        self._past = Past(run_number)
        self._faults_seen = 0
        self._next_failure_s = 0.0
        self._next_frame_s = self._next_slow_s = self._next_findings_s = self._next_verdicts_s = 0.0
        self._last_frame_s = 0.0
        self._pace = 0.0
        self.measure_pace(wall_s)

    def close(self) -> None:
        self._transfers.close()
        self._recorder.close()

    # -- called by the session ------------------------------------------------------------------------------

    def greet(self, client: object, hello: messages.Hello, status: messages.StatusEvent) -> None:
        self._publish(hello, client)
        self._publish(status, client)
        self._publish(self._past.message(), client)
        self._publish(self._text(max(0, self._board.terminal.position - _HISTORY)), client)
        self._publish(self._verdicts, client)
        self._publish(messages.Findings(self._findings), client)
        self.look_again()
        self._next_frame_s = 0.0

    def look_again(self) -> None:
        self._registers.clear()
        self._next_slow_s = 0.0

    def answer(self, number: int) -> None:
        """Confirm command ``number`` in the next frame, and send that frame soon."""
        self._done = number
        self._next_frame_s = min(self._next_frame_s, self._last_frame_s + _ANSWER_S)

    def measure_pace(self, wall_s: float) -> None:
        self._paced_from = wall_s, self._board.now_s

    def frame_in_s(self, wall_s: float) -> float:
        frame_s = self._next_frame_s - wall_s
        if self._clients and (frame_s > 0.0 or self.changed):  # an overdue frame without changes can wait
            return frame_s
        return math.inf

    # -- due events -----------------------------------------------------------------------------------------

    def show(self, wall_s: float, running: bool) -> None:
        """Send due events. Only a ``running`` board has a pace."""
        if not self._clients:
            self._keep_unseen(wall_s, running)
            return
        if wall_s >= self._next_frame_s and (self.changed or wall_s >= self._next_frame_s + _HEARTBEAT_S):
            # The next due time is counted from this frame's due time; otherwise a slightly late frame would
            # skip the next frame.
            due_s = max(self._next_frame_s, wall_s - _FRAME_S / 2)
            self._last_frame_s, self._next_frame_s = wall_s, due_s + _FRAME_S
            self.changed = False
            self.show_text()
            self._show_state(wall_s, running)
        if wall_s >= self._next_slow_s:
            self._next_slow_s = wall_s + _SLOWLY_S
            self._show_slowly()
        if wall_s >= self._next_verdicts_s:
            self._next_verdicts_s = wall_s + _VERDICTS_S
            self._publish_verdicts()
        if wall_s >= self._next_findings_s or self._has_failed(wall_s):
            self._next_findings_s = wall_s + _FINDINGS_S
            self.publish_findings()

    def _keep_unseen(self, wall_s: float, running: bool) -> None:
        self.show_text()
        if running and wall_s >= self._next_frame_s:
            self._next_frame_s = wall_s + _UNSEEN_S
            self._show_state(wall_s, running)

    def _show_state(self, wall_s: float, running: bool) -> None:
        state = self._state(wall_s, running)
        self._past.add_state(state, wall_s)
        self._publish(state, None)

    def _has_failed(self, wall_s: float) -> bool:
        arm = self._board.chip
        if arm is None:
            return False
        faults, self._faults_seen = self._faults_seen, arm.faults.seen
        if faults != arm.faults.seen:
            return True
        if wall_s < self._next_failure_s or any(one["fatal"] for one in self._findings):
            return False
        self._next_failure_s = wall_s + _FAILURE_S
        diagnosis = arm.diagnosis()
        return diagnosis is not None and diagnosis.fatal

    def _state(self, wall_s: float, running: bool) -> messages.State:
        board = self._board
        from_wall_s, from_s = self._paced_from
        if wall_s - from_wall_s >= _PACE_S:
            self._pace = (board.now_s - from_s) / (wall_s - from_wall_s)
            self.measure_pace(wall_s)
        is_old = board.now_s - self._truth_s > _TRUTH_S
        if not self._truth or is_old or not board.world.rests(self._truth_s, board.now_s):
            self._truth = view.truth(board)  # stored, because evaluating the same truth again is expensive
            self._truth_s = board.now_s
        names = dict.fromkeys(name for watch in self._clients.values() for name in watch.variables)
        values: dict[str, float] = {}
        for name in names:
            values.update(view.variable(board, name))
        return messages.State(
            run=self._run_number,
            t_s=board.now_s,
            pace=round(self._pace, 3) if running else 0.0,
            leds={name: led.on for name, led in board.leds.items()},
            truth=self._truth,
            samples=transfers.samples(board, self._transfers.latest()),
            variables=values,
            load=self._load.figures(),
            done=self._done,
        )

    def _text(self, position: int) -> messages.Text:
        data, end = self._board.terminal.since(position)
        return messages.Text(self._run_number, end - len(data), data.decode("latin-1"))

    def show_text(self) -> None:
        text = self._text(self._position)
        self._position = text.position + len(text.text)
        if not text.text:
            return
        self._publish(text, None)
        *lines, self._line_rest = (self._line_rest + text.text.encode("latin-1")).split(b"\n")
        self._line_rest = self._line_rest[-_LONGEST_LINE:]
        for raw in lines:
            line = raw.decode("latin-1").strip(" \r\t")
            for line_format in FORMATS:
                values = line_format.parse(line) if line.startswith(line_format.label) else None
                if values is not None:
                    printed = self._printed(values)
                    self._past.add_printed(printed)
                    self._publish(printed, None)

    def _printed(self, values: dict[str, float]) -> messages.PrintedEvent:
        board = self._board
        finite = {name: value for name, value in values.items() if math.isfinite(value)}
        now = view.instant(board)
        truth = {name: round(float(TRUTH[name](board.world, now)[0]), 4) for name in finite}
        return messages.PrintedEvent(board.now_s, finite, truth)

    def _show_slowly(self) -> None:
        board, watches = self._board, self._clients.values()
        for name in {watch.registers for watch in watches if watch.registers}:
            if name not in self._registers:
                if not registers.known(board, name):
                    continue
                self._publish(messages.Declared(registers.declaration(board, name)), None)
            shown = messages.RegistersEvent(name, registers.values(board, name), registers.note(board, name))
            if shown != self._registers.get(name):
                self._registers[name] = shown
                self._publish(shown, None)
        if any(watch.bus for watch in watches):
            self._publish(messages.BusEvent(transfers.transfers(board, self._transfers.latest())), None)
        if any(watch.pins for watch in watches):
            self._publish(messages.Pins(pins.pins(board)), None)

    def _publish_verdicts(self) -> None:
        board, plan = self._board, self._board.scenario
        if plan is None:
            return
        shown = [
            {
                "key": one.key,
                "kind": one.kind,
                "says": one.says,
                "state": one.state,
                "found": one.summary if one.state == "failed" else "",
            }
            for one in plan.results(board)
        ]
        verdicts = messages.Verdicts(shown, plan.is_over(board))
        if verdicts != self._verdicts:
            self._verdicts = verdicts
            self._publish(verdicts, None)

    def publish_findings(self) -> None:
        # slow import: loads the diagnosis
        from fcu_emulator.emulator.analysis.mistakes import explain, without_explained

        seen = {one.summary: one for one in self.checked}
        for one in without_explained(explain(self._board, self._recorder), self.checked):
            seen.setdefault(one.summary, one)
        found = [one.as_data() for one in sorted(seen.values(), key=lambda one: not one.fatal)]
        if found != self._findings:
            self._findings = found
            self._publish(messages.Findings(found), None)
