"""Snapshots of a board's whole state.

Decision: a snapshot walks the board's objects and records their contents, so that it cannot miss a
new attribute. For each kind of object, the walk records:

* objects of this package, of ``sensors``, and of subclasses: attributes;
* lists, dictionaries, sets, deques and byte arrays: contents, restored in place because they are
  shared;
* functions of these packages: closures (the variables of closures must never be rebound);
* objects with ``snapshot()`` and ``restore(state)``: also their state outside Python. The trace is
  not walked;
* objects of a class with ``in_snapshots = False``, such as a debugger's breakpoints: nothing;
* numpy arrays (never changed in place) and all other objects: the reference.

A board with Python firmware has no snapshots, because its stack cannot be copied.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from types import CellType, FunctionType, MethodType
from typing import Any, Protocol, cast

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.trace import Trace
from fcu_emulator.emulator.world.attitude import Held
from fcu_emulator.emulator.world.follow import Approach, FollowedAttitude, FollowedHeight
from fcu_emulator.emulator.world.track import Constant
from fcu_emulator.sensors.filters import Chain
from fcu_emulator.sensors.register import RegisterMap

_PACKAGES = ("fcu_emulator.",)
_CONSTANT = (
    type,
    RegisterMap,
    Chain,
    Approach,
    FollowedAttitude,
    FollowedHeight,
    Held,
    Constant,
)  # never changed
_VALUES = frozenset((int, str, bytes, float, bool, type(None)))


class Snapshotted(Protocol):
    """An object with state outside Python."""

    def snapshot(self) -> Any:
        """Return the state outside Python. Raises InputError."""
        ...

    def restore(self, state: Any) -> None: ...


class Snapshot:
    """The state of all objects reachable from ``root``."""

    def __init__(self, root: object) -> None:
        self._root = root
        self._attributes: list[tuple[dict[str, Any], dict[str, Any]]] = []
        self._slots: list[tuple[Callable[[Any, Any], None], object, Any]] = []
        self._lists: list[tuple[list[Any] | bytearray, list[Any] | bytes]] = []
        # for each container: method to empty it, method to fill it, contents
        self._others: list[tuple[Any, Any, Any]] = []
        self._asked: list[tuple[Snapshotted, Any]] = []
        self._seen: dict[int, object] = {}  # also keeps the objects alive, so that their ids stay unique
        self._walk(root)

    def restore(self, root: object) -> None:
        """Restore the state. Raises InputError for another ``root``."""
        if root is not self._root:
            raise InputError(
                "the snapshot must be of this board; restore it on the board from which it was taken"
            )
        for attributes, saved in self._attributes:
            if len(attributes) != len(saved):
                attributes.clear()
            attributes.update(saved)
        for put, owner, value in self._slots:
            put(owner, value)
        for items, kept in self._lists:
            items[:] = kept
        for empty, fill, content in self._others:
            empty()
            fill(content)
        for one, state in self._asked:
            one.restore(state)

    # -- the walk ---------------------------------------------------------------------------------------

    def _walk(self, root: object) -> None:
        waiting: list[object] = list(self._own(root))
        self._seen[id(root)] = root
        while waiting:
            one = waiting.pop()
            if type(one) in _VALUES or id(one) in self._seen:
                continue
            if not isinstance(one, _CONSTANT) and getattr(type(one), "in_snapshots", True):
                self._seen[id(one)] = one
                waiting.extend(self._note(one))

    def _note(self, one: object) -> Iterable[object]:
        for kind in type(one).__mro__:
            note = _NOTES.get(kind)
            if note is not None:
                return note(self, one)
        return self._note_object(one) if _is_ours(type(one)) else ()

    def _note_object(self, one: object) -> Iterable[object]:
        if hasattr(type(one), "snapshot") and hasattr(type(one), "restore"):
            asked = cast(Snapshotted, one)
            self._asked.append((asked, asked.snapshot()))
        return () if isinstance(one, Trace) else self._own(one)

    def _note_list(self, items: list[Any]) -> Iterable[object]:
        self._lists.append((items, list(items)))
        return items

    def _note_bytes(self, items: bytearray) -> Iterable[object]:
        self._lists.append((items, bytes(items)))
        return ()

    def _note_dict(self, entries: dict[Any, Any]) -> Iterable[object]:
        self._others.append((entries.clear, entries.update, dict(entries)))
        return (*entries.keys(), *entries.values())

    def _note_set(self, items: set[Any]) -> Iterable[object]:
        self._others.append((items.clear, items.update, tuple(items)))
        return items

    def _note_deque(self, items: deque[Any]) -> Iterable[object]:
        self._others.append((items.clear, items.extend, tuple(items)))
        return items

    def _note_function(self, function: FunctionType) -> Iterable[object]:
        ours = function.__module__ is not None and function.__module__.startswith(_PACKAGES)
        return (function.__closure__ or ()) if ours else ()

    def _note_cell(self, cell: CellType) -> Iterable[object]:
        try:
            return (cell.cell_contents,)
        except ValueError:  # the function has not assigned the variable yet
            return ()

    def _own(self, one: object) -> Iterator[object]:
        attributes = getattr(one, "__dict__", None)
        if attributes is not None:
            self._attributes.append((attributes, dict(attributes)))
            yield from attributes.values()
        for kind in type(one).__mro__:
            for name in _slots(kind):
                descriptor = kind.__dict__[name]
                try:
                    value = descriptor.__get__(one)
                except AttributeError:  # unset; it will be assigned before use
                    continue
                self._slots.append((descriptor.__set__, one, value))
                yield value


def _is_ours(kind: type) -> bool:
    return any(base.__module__.startswith(_PACKAGES) for base in kind.__mro__)


def _slots(kind: type) -> tuple[str, ...]:
    names = kind.__dict__.get("__slots__", ())
    every = (names,) if isinstance(names, str) else tuple(names)
    return tuple(name for name in every if name not in {"__dict__", "__weakref__"})


_NOTES: dict[type, Callable[[Snapshot, Any], Iterable[object]]] = {
    list: Snapshot._note_list,
    bytearray: Snapshot._note_bytes,
    dict: Snapshot._note_dict,
    set: Snapshot._note_set,
    deque: Snapshot._note_deque,
    tuple: lambda _, items: items,
    MethodType: lambda _, method: (method.__self__, method.__func__),
    partial: lambda _, part: (part.func, *part.args, *part.keywords.values()),
    FunctionType: Snapshot._note_function,
    CellType: Snapshot._note_cell,
}
"""By class: a function that records an object of this class and returns its references."""
