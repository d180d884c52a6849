"""Recording of a test's actions on its board, as a scenario for ``fcu run``.

Decision: the actions of a test are recorded by subclasses of the board's objects. Hooks in world,
terminal and buses would run on every board, although only failing tests need them.
"""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.gpio import BUTTON_S
from fcu_emulator.emulator.buses.i2c import I2CFault
from fcu_emulator.emulator.clock import NEVER_PS, format_duration, to_ps
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.live.recording import SessionRecording
from fcu_emulator.emulator.scenario.timeline import DURATIONS, LONGEST_INPUT, RunMotors
from fcu_emulator.emulator.scenario.toml_writer import parse_entry
from fcu_emulator.emulator.world import World

_KEYS = {"hpa": "pressure_hpa", "degc": "temperature_degc", "percent": "humidity_percent"}
_LENGTHS = {argument: key.rstrip("_") for key, argument in DURATIONS.items()}
_FIELD = ("north_ut", "east_ut", "down_ut")
_NO_ENTRY = frozenset(
    {
        "set_altitude",
        "warm_up",
        "replay",
        "set_hard_iron",
        "set_soft_iron",
        "set_iron",
        "set_gravity",
        "let_pressure_wander",
        "put_steel",
        "take_steel_away",
    }
)
_NOT_A_CHANGE = frozenset({"on_change", "throttle"})
_CHANGES = tuple(
    name
    for name, value in vars(World).items()
    if inspect.isfunction(value) and not name.startswith("_") and name not in _NOT_A_CHANGE
)
_AT_POWER_ON: Mapping[str, Callable[[Mapping[str, Any]], dict[str, object]]] = {
    "set_hard_iron": lambda given: {"hard_iron_mgauss": [float(one) for one in given.values()]},
    "set_soft_iron": lambda given: {"soft_iron": _rows(given["matrix"])},
    "set_iron": lambda given: {
        "hard_iron_mgauss": [float(one) for one in given["hard_mgauss"]],
        "soft_iron": _rows(given["soft"]),
    },
    "set_gravity": lambda given: {"gravity": float(given["m_s2"])},
}
"""Methods that correspond to a key of [world] and can be recorded only at power-on."""


class BoardRecording:
    """Recorder of actions on ``board`` from power-on. ``cold``: the sensors also start at power-on."""

    def __init__(self, board: Board, cold: bool = False) -> None:
        self._board = board
        self._cold = cold
        self._recording = SessionRecording(board, board.ideal, source="A test", cold=cold)
        self._missing: Counter[str] = Counter()
        self._inside = False
        self._done = False
        plan = board.scenario
        self._steps_ps = {step.at_ps for step in plan.steps} if plan else set()
        self._motors_follow = plan is not None and any(
            isinstance(step.entry, RunMotors) and step.entry.throttle == "firmware" for step in plan.steps
        )
        self._watch(board.world, _CHANGES, self._world)
        self._watch(board.terminal, ("write",), self._typed)
        first = board.i2c()
        for name in board.description.i2c:
            master = board.i2c(name)
            self._watch(master, ("inject",), self._fault if master is first else self._lost(name.lower()))
            self._watch(master, ("write", "read", "write_read"), self._lost(name.lower()))
        for name in board.description.spi:
            self._watch(board.spi(name), ("configure", "write", "write_read"), self._lost(name.lower()))
        self._watch(board, ("set_variable", "restore"), self._lost())
        self._watch(board, ("call",), self._called)
        self._watch(board, ("press_button",), self._pressed)

    @property
    def missing(self) -> list[str]:
        """Actions that are missing in the scenario."""
        return [f"{name}{f', {count} times' * (count > 1)}" for name, count in self._missing.items()]

    @property
    def needed(self) -> bool:
        """Whether ``fcu run`` needs a scenario, because an action was recorded or the start is cold."""
        return self._done or self._cold

    def text(self) -> str:
        """Return the scenario. Raises InputError if the test's scenario plays recordings."""
        return self._recording.text()

    # -- recorded actions ------------------------------------------------------------------------------

    def _world(self, name: str, at_ps: int, given: dict[str, Any]) -> None:
        start_s = given.pop("start_s", None)
        if start_s is not None:
            at_ps = max(to_ps(start_s), at_ps)
        if name in _NO_ENTRY:
            if at_ps == 0 and name in _AT_POWER_ON:
                self._recording.world.update(_AT_POWER_ON[name](given))
                self._done = True
            else:
                self._lose(f"board.world.{name}")
            return
        table: dict[str, Any] = {"do": "set_field" if name == "set_magnetic_field" else name}
        if all(key in given for key in _FIELD):
            table["field"] = {key: given.pop(key) for key in _FIELD}
        for key, value in given.items():
            if key in _LENGTHS:
                table[_LENGTHS[key]] = format_duration(to_ps(value))
            else:
                table[_KEYS.get(key, key)] = _plain(value)
        self._add(at_ps, table, f"board.world.{name}")

    def _typed(self, name: str, at_ps: int, given: dict[str, Any]) -> None:
        data = given["data"]
        sent = data.encode("latin-1") if isinstance(data, str) else bytes(data)
        for begin in range(0, len(sent), LONGEST_INPUT):
            part = sent[begin : begin + LONGEST_INPUT]
            self._add(at_ps, {"do": "send", "hex": part.hex(" ")}, f"board.terminal.{name}")

    def _fault(self, name: str, at_ps: int, given: dict[str, Any]) -> None:
        fault: I2CFault = given["fault"]
        table: dict[str, Any] = {"do": "inject_fault", "kind": fault.kind, "byte_index": fault.byte_index}
        begin_ps = max(fault.from_ps, at_ps)
        if fault.until_ps < NEVER_PS:
            table["for"] = format_duration(fault.until_ps - begin_ps)
        if fault.address is not None:
            table["address"] = fault.address
        self._add(begin_ps, table, f"board.i2c2.{name}")

    def _pressed(self, name: str, at_ps: int, given: dict[str, Any]) -> None:
        table = {"do": "press_button", "pin": given["pin"], "level": given.get("level", 0)}
        table["for"] = format_duration(to_ps(given.get("seconds", BUTTON_S)))
        self._add(at_ps, table, f"board.{name}")

    def _called(self, name: str, at_ps: int, given: dict[str, Any]) -> None:
        del at_ps
        if given.get("keep"):
            self._lose(f"board.{name}(..., keep=True)")

    def _lost(self, owner: str = "") -> Callable[[str, int, dict[str, Any]], None]:
        def lost(name: str, at_ps: int, given: dict[str, Any]) -> None:
            del at_ps, given
            self._lose(".".join(filter(None, ("board", owner, name))))

        return lost

    def _add(self, at_ps: int, table: dict[str, Any], what: str) -> None:
        try:
            kept = self._recording.add(at_ps, parse_entry(table, self._board.description))
        except InputError:
            kept = False
        if kept:
            self._done = True
        else:
            self._lose(what)

    def _lose(self, what: str) -> None:
        self._missing[what] += 1

    # -- interception of calls -------------------------------------------------------------------------

    def _watch(
        self, owner: object, names: Iterable[str], note: Callable[[str, int, dict[str, Any]], None]
    ) -> None:
        """Call ``note`` after each call of these methods."""
        kind: Any = type(owner)
        methods = {name: self._noting(getattr(kind, name), name, note) for name in names}
        owner.__class__ = type(kind.__name__, (kind,), {"__module__": kind.__module__, **methods})

    def _noting(
        self, method: Callable[..., Any], name: str, note: Callable[[str, int, dict[str, Any]], None]
    ) -> Callable[..., Any]:
        signature = inspect.signature(method)

        def called(owner: Any, *arguments: Any, **named: Any) -> Any:
            at_ps = self._time_ps(name)
            if at_ps is None:
                return method(owner, *arguments, **named)
            self._inside = True
            try:
                result = method(owner, *arguments, **named)
            finally:
                self._inside = False
            bound = signature.bind(owner, *arguments, **named)
            bound.apply_defaults()
            note(name, at_ps, dict(list(bound.arguments.items())[1:]))
            return result

        return called

    def _time_ps(self, name: str) -> int | None:
        """Return the time of a call by the test, after all due events. Return None for other calls."""
        now_ps = self._board.clock.now_ps
        if self._inside:
            return None
        if not self._board.running:
            return now_ps + (1 if now_ps else 0)
        by_scenario = now_ps in self._steps_ps or (name == "run_motors" and self._motors_follow)
        return None if by_scenario else now_ps


def by_hand(board: Board, recording: BoardRecording | None, save: Callable[[str], str]) -> Iterator[str]:
    """Yield the command that repeats the test's run, and the differences from the test.

    ``save(text)`` writes a scenario and returns its path.
    """
    if not board.booted.name:
        yield "no command: this firmware has neither a name nor a file for fcu run"
        return
    words = ["fcu", "run", str(board.booted.name)]
    missing = list(recording.missing) if recording else []
    if recording is not None and recording.needed:
        try:
            scenario = save(recording.text())
        except InputError as error:
            yield f"not saved as a scenario: {error}"
            return
        yield command_line(
            [*words, "--wiring", board.booted.wiring.name, "--scenario", scenario, "--speed", "max"]
        )
        yield "The scenario has the test's actions on the board, without expectations."
    else:
        words += ["--scenario", str(board.scenario.file)] if board.scenario else []
        words += ["--wiring", board.booted.wiring.name, "--seed", str(board.seed)]
        words += ["--ideal"] if board.ideal else []
        words += ["--duration", f"{max(board.now_s, 0.001):.3f}s", "--speed", "max"]
        yield command_line(words)
    if missing:
        yield f"It does not contain: {'; '.join(missing)}."


def _plain(value: Any) -> Any:
    if isinstance(value, str | bool) or value is None:
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(one) for one in value] if isinstance(value, Iterable) else value


def _rows(matrix: Any) -> list[list[float]]:
    return [[float(value) for value in row] for row in matrix]
