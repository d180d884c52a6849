"""A live board that is moved and run, and whose terminal, registers, variables and transfers are read.

Its virtual time passes only in ``run``, ``expect`` and ``transfers``. These methods run the board in slices, so that a
call ends soon after its wall time is over.
All methods must be called by one thread.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, Final

from fcu_emulator.emulator.agents.commands import TimeLimit
from fcu_emulator.emulator.agents.texts import latest, lines_of, page
from fcu_emulator.emulator.analysis.mistakes import explain
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.buses.uart import decoded
from fcu_emulator.emulator.errors import ExpectationError, FirmwareError, InputError
from fcu_emulator.emulator.live import registers, view
from fcu_emulator.emulator.live.control import ControlRequests
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.emulator.live.transfers import Transfers, transfers
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.trace import BusTransfer, TraceEvent

_SLICE_S: Final = 0.05  # virtual time between two checks of the wall clock
_EXPECT_SLICE_S: Final = 0.25  # longer, because the end of each slice without the text has a diagnosis
_REST_OF_LINE_S: Final = 0.1  # virtual time in which the rest of a found line is printed
_MOST_REGISTERS: Final = 40
_MOST_NAMES: Final = 200
_MOST_TRANSFERS: Final = 100
_LARGEST_TERMINAL: Final = 1 << 16  # bytes that are decoded for one page
_LONGEST_ROW: Final = 500  # bytes of a line that are shown in one line
_ANGLES: Final = ("roll_deg", "pitch_deg", "yaw_deg", "altitude_m")


class LiveBoard:
    """A board of ``setup``, switched on. Raises FcuError."""

    def __init__(self, setup: Setup) -> None:
        self._board = board = setup.power_on()
        self._recorder = TruthRecorder(board)
        self._transfers = Transfers(board)
        self._control = ControlRequests(board)
        self._failure = ""

    @property
    def firmware(self) -> str:
        """The firmware's path, or the name of a shipped program."""
        return self._board.booted.name

    def close(self) -> None:
        """Switch the board off."""
        self._board.close()

    def state(self) -> dict[str, Any]:
        """Return the firmware, the virtual time, the LEDs, the attitude, the state and, after a failure, its cause."""
        board, truth = self._board, view.truth(self._board)
        state: dict[str, Any] = {
            "firmware": board.booted.name,
            "wiring": board.booted.wiring.name,
            "now_s": round(board.now_s, 9),
            "state": "failed" if self._failure else "ready",
            "leds": {name: led.on for name, led in board.leds.items()},
            "attitude": {name: truth[name] for name in _ANGLES},
            "position": board.terminal.position,
        }
        if self._failure:
            state["failure"] = "\n".join(lines_of(self._failure)[:_MOST_REGISTERS])
        if board.scenario is not None:
            state["expectations"] = [
                {"says": one.says, "state": one.state} for one in board.scenario.results(board)
            ][:_MOST_REGISTERS]
        return state

    def act(self, entry: Mapping[str, Any]) -> dict[str, Any]:
        """Start the action of a timeline entry now. Raises InputError."""
        self._control.answer({"type": "do", "entry": dict(entry)})
        return self.state()

    # -- Time passes ----------------------------------------------------------------------------------------

    def run(self, seconds: float, limit: TimeLimit) -> dict[str, Any]:
        """Run for this virtual time, and return the output of this time."""
        begin = self._board.terminal.position
        reached = self._run(seconds, limit)
        return self.state() | self._printed(begin) | ({} if reached else self._too_slow(limit))

    def expect(self, text: str, timeout_s: float, since: int | None, limit: TimeLimit) -> dict[str, Any]:
        """Run until the text is printed. ``found``: whether it was printed within ``timeout_s``."""
        terminal = self._board.terminal
        begin = terminal.position if since is None else since
        end_s = self._board.now_s + timeout_s
        match: re.Match[str] | None = None
        while match is None:
            left_s = max(end_s - self._board.now_s, 0.0)
            try:
                match = self._guarded_expect(text, min(left_s, _EXPECT_SLICE_S), begin)
            except ExpectationError:
                if left_s <= _EXPECT_SLICE_S or limit.over:
                    break
            if self._failure:
                break
        if match is None:
            late = limit.over and self._board.now_s < end_s and not self._failure
            problems = {"problems": self.problems()}
            slow = self._too_slow(limit) if late else {}
            return {"found": False} | self.state() | self._printed(begin) | problems | slow
        match_end = terminal.match_end
        with suppress(ExpectationError):  # complete the line
            self._guarded_expect("\n", _REST_OF_LINE_S, match_end)
        return {"found": True, "line": self._line(begin, match_end), "match_end": match_end} | self.state()

    def _guarded_expect(self, text: str, timeout_s: float, since: int) -> re.Match[str] | None:
        self._check_running(timeout_s)
        try:
            return self._board.terminal.expect(re.escape(text), timeout_s, since=since)
        except FirmwareError as error:
            self._failure = str(error)
            return None

    def transfers(self, run_s: float, limit: TimeLimit) -> dict[str, Any]:
        """Return the transfers of the next ``run_s``, or with 0 the latest transfers."""
        board = self._board
        if not run_s:
            return self.state() | {"transfers": transfers(board, self._transfers.latest())}
        recorder = _FirstTransfers()
        stop = board.trace.subscribe(recorder.record)
        try:
            reached = self._run(run_s, limit)
        finally:
            stop()
        count, found = recorder.count, recorder.found
        result = self.state() | {"count": count, "transfers": transfers(board, found)}
        if count > len(found):
            result["cut"] = f"the first {len(found)} of {count} transfers"
            result["rest"] = "the other transfers are not kept; call transfers with a smaller run_s"
        return result | ({} if reached else self._too_slow(limit))

    def _run(self, seconds: float, limit: TimeLimit) -> bool:
        """Run for this virtual time. Return False if the wall time is over first."""
        self._check_running(seconds)
        board = self._board
        end_s = board.now_s + seconds
        while board.now_s < end_s and not self._failure:
            if limit.over:
                return False
            try:
                board.run_until(min(end_s, board.now_s + _SLICE_S))
            except FirmwareError as error:
                self._failure = str(error)
        return True

    def _check_running(self, seconds: float) -> None:
        if self._failure and seconds > 0:
            raise InputError(
                "the firmware has failed, so the board cannot run; call start_board again", kind="failed"
            )

    def _too_slow(self, limit: TimeLimit) -> dict[str, Any]:
        text = f"at {self._board.now_s:.3f} s, after {limit.wall_s:g} s of wall time; call the tool again"
        return {"ended_early": text}

    # -- No time passes -------------------------------------------------------------------------------------

    def terminal(self, since: int) -> dict[str, Any]:
        """Return a page of the output that begins at a byte position."""
        data, end = self._board.terminal.since(since)
        begin = end - len(data)
        text, used = _first_page(data[:_LARGEST_TERMINAL])
        result: dict[str, Any] = {"text": text, "from": begin, "to": begin + used, "end": end}
        if begin > since:
            result["lost"] = f"the output before byte {begin} is not kept"
        if begin + used < end:
            result |= {"cut": f"{end - begin - used} more bytes", "rest": f"terminal(since={begin + used})"}
        return result

    def registers(self, part: str, register: str | None, first: int) -> dict[str, Any]:
        """Return decoded registers. Raises InputError for an unknown part or register."""
        board = self._board
        known = [*(one.NAME for one in board.sensors), *registers.peripheral_names(board)]
        name = next((one for one in known if one.casefold() == part.casefold()), None)
        if name is None:
            raise InputError(f"unknown part {shown(part)}; known: {', '.join(known)}", kind="unknown_part")
        declared, values = registers.declaration(board, name), registers.values(board, name)
        rows = [one for one in declared["registers"] if one["name"] in values]
        if register is not None:
            rows = [one for one in rows if one["name"].casefold() == register.casefold()]
            if not rows:
                names = ", ".join(values)
                raise InputError(f"{name} has no register {shown(register)}; it has {names}"[:1000])
        table = [_decoded(one, values[one["name"]], register is not None) for one in rows]
        result: dict[str, Any] = {
            "part": name,
            "place": declared["place"],
            "now_s": round(board.now_s, 9),
            "registers": table[first : first + _MOST_REGISTERS],
        }
        if remark := registers.note(board, name):
            result["note"] = remark
        return result | _cut("registers", first, _MOST_REGISTERS, len(table), f'registers(part="{name}", ')

    def variables(self, names: list[str], first: int) -> dict[str, Any]:
        """Return the numbers of variables, or the names of all variables. Raises InputError."""
        board = self._board
        if not names:
            known = view.variable_names(board)
            rest = _cut("variables", first, _MOST_NAMES, len(known), "variables(")
            return {"names": known[first : first + _MOST_NAMES]} | rest
        values: dict[str, float | str] = {}
        for name in names:
            numbers = view.numbers(board, name)
            if not numbers:
                raise InputError(view.why_not_watched(board, name), kind="unknown_variable")
            values |= {one: value if math.isfinite(value) else str(value) for one, value in numbers.items()}
        return {"now_s": round(board.now_s, 9), "values": values}

    def problems(self) -> list[dict[str, Any]]:
        """Return the firmware's problems until now, the worst first."""
        return [one.as_data() for one in explain(self._board, self._recorder)][:_MOST_REGISTERS]

    def printed_numbers(self, field: str) -> dict[str, Any]:
        """Return the latest printed value of a field such as ``Pitch``, and the range of its true value, or {}."""
        for line in reversed(self._recorder.lines):
            names = {name.casefold(): name for name in line.truth}
            name = names.get(field.casefold())
            if name is not None and line.values is not None:
                truth = line.truth[name]
                value = {"printed": line.values[name], "truth": [truth.low, truth.high]}
                return {"latest": value | {"at_s": round(line.at_s, 6), "line": line.text[:200]}}
        return {}

    def _line(self, begin: int, position: int) -> str:
        """Return the line that contains the byte before ``position``, without output before byte ``begin``."""
        data, end = self._board.terminal.since(begin)
        last = max(position - 1 - (end - len(data)), 0)
        first = data.rfind(b"\n", 0, last) + 1
        line = decoded(data[first:].partition(b"\n")[0]).strip("\r ")
        return (lines_of(line) or [""])[0]

    def _printed(self, begin: int) -> dict[str, Any]:
        """Return the end of the output since a byte position, and the call that returns the beginning."""
        data, end = self._board.terminal.since(begin)
        tail = data[-_LARGEST_TERMINAL:]
        lines = lines_of(decoded(tail))
        kept = latest(lines)
        result: dict[str, Any] = {"printed": "\n".join(kept)}
        if len(kept) < len(lines) or len(tail) < end - begin:
            cut = f"the end of the {end - begin} bytes that were printed"
            result |= {"cut": cut, "rest": f"terminal(since={begin})"}
        return result


class _FirstTransfers:
    """The first transfers of a run, and the number of all transfers."""

    def __init__(self) -> None:
        self.found: list[BusTransfer] = []
        self.count = 0

    def record(self, event: TraceEvent) -> None:
        if isinstance(event, BusTransfer):
            self.count += 1
            if len(self.found) < _MOST_TRANSFERS:
                self.found.append(event)


def _first_page(data: bytes) -> tuple[str, int]:
    """Return the text of the first lines that fit into a page, and their number of bytes."""
    lines: list[str] = []
    used = 0
    for row in _rows(data):
        more = lines_of(decoded(row.strip(b"\r\n"))) or [""]
        if page([*lines, *more])[1] <= len(lines) + len(more):
            break
        lines += more
        used += len(row)
    return "\n".join(lines), used


def _rows(data: bytes) -> Iterator[bytes]:
    """Yield the lines with their line ends, and a long line in pieces."""
    begin = 0
    while begin < len(data):
        newline = data.find(b"\n", begin, begin + _LONGEST_ROW)
        end = newline + 1 if newline >= 0 else begin + _LONGEST_ROW
        yield data[begin:end]
        begin = end


def _decoded(row: Mapping[str, Any], value: str, with_meanings: bool) -> dict[str, Any]:
    number = int(value, 16)
    fields = {
        one["name"]: (number >> one["lsb"]) & ((2 << (one["msb"] - one["lsb"])) - 1) for one in row["fields"]
    }
    result: dict[str, Any] = {
        "name": row["name"],
        "address": f"0x{row['address']:02X}",
        "value": f"0x{value}",
        "fields": fields,
    }
    if with_meanings:
        result |= {
            "meaning": row["doc"],
            "reset": f"0x{row['reset']:0{2 * row['size']}X}",
            "access": row["access"],
            "modelled": row["modelled"],
            "meanings": {one["name"]: one["doc"] for one in row["fields"]},
        }
    return result


def _cut(what: str, first: int, most: int, count: int, call: str) -> dict[str, str]:
    """Return the keys ``cut`` and ``rest`` of a list that has more entries."""
    if first + most >= count:
        return {}
    return {"cut": f"{what} {first + 1} to {first + most} of {count}", "rest": f"{call}first={first + most})"}
