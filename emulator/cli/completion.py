"""Completion of names in a shell: shipped firmware, scenarios and rubrics, wirings, sensors, peripherals, and files.

Decision: files with the right ending are offered together with the names, and other files only if nothing else begins
with the typed text. In bash, the shell's own completion of files would replace the names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from click import Context, Parameter

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

Names = Callable[[], Mapping[str, str]]
"""A function that returns names with their descriptions, which zsh and fish show."""
_MOST_FILES: Final = 100


def _complete(
    names: Names, suffixes: tuple[str, ...], context: Context, parameter: Parameter, typed: str
) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem  # the import takes 10 ms

    del context, parameter
    found = [
        CompletionItem(name, help=about or None)
        for name, about in names().items()
        if name.casefold().startswith(typed.casefold())
    ]
    found += [CompletionItem(path) for path in _files(typed, suffixes)]
    return found or ([CompletionItem(typed, type="file")] if suffixes else [])


def _files(typed: str, suffixes: tuple[str, ...]) -> Iterator[str]:
    """Yield the files with one of these endings whose path begins with the typed text."""
    before, separator, name = typed.rpartition("/")
    folder = Path(before + separator) if separator else Path()
    try:
        found = sorted(path.name for path in folder.iterdir() if path.suffix.lower() in suffixes)
    except OSError:
        return
    yield from [f"{before}{separator}{one}" for one in found if one.startswith(name)][:_MOST_FILES]


def _firmware() -> Mapping[str, str]:
    from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1

    return FCU001V1.firmware


def _scenarios() -> Mapping[str, str]:
    from fcu_emulator.emulator.scenario import scenario_names

    return scenario_names()


def _wirings() -> Mapping[str, str]:
    from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1

    return {wiring.name: f"sensors on {wiring.bus}" for wiring in FCU001V1.wirings}


def _rubrics() -> Mapping[str, str]:
    from fcu_emulator.emulator.grading.rubric import rubric_names

    return dict.fromkeys(rubric_names(), "")


def _parts() -> Mapping[str, str]:
    from fcu_emulator.emulator.chip.registers import DECLARED
    from fcu_emulator.sensors import SENSORS

    sensors = {name: ", ".join(one.doc for one in part.SIGNALS) for name, part in SENSORS.items()}
    return sensors | {name: one.title for name, one in DECLARED.items()}


FIRMWARE: Final[Any] = partial(_complete, _firmware, (".elf", ".hex", ".bin"))
SCENARIO: Final[Any] = partial(_complete, _scenarios, (".toml",))
RUBRIC: Final[Any] = partial(_complete, _rubrics, (".toml",))
WIRING: Final[Any] = partial(_complete, _wirings, ())
PART: Final[Any] = partial(_complete, _parts, ())
