"""The source line that belongs to a failed expectation: the statement that prints, switches a LED, or waits."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import SequenceMatcher
from typing import Final

from fcu_emulator.emulator.analysis.led_statements import led_place
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK, Places
from fcu_emulator.emulator.chip.diagnosis.diagnose import waiting_call
from fcu_emulator.emulator.chip.diagnosis.printing import Format, PrintedLines
from fcu_emulator.emulator.scenario.expectations import ExpectField, ExpectPrinted, ExpectWithin
from fcu_emulator.emulator.scenario.formats import NamedFormat, NumberFormat
from fcu_emulator.emulator.scenario.hardware import ExpectLed, ExpectLedFollows, ExpectReads, ExpectTicks
from fcu_emulator.emulator.scenario.run_view import FIELDS

_Printed = ExpectField | ExpectPrinted | ExpectWithin
_SIMILAR: Final = 0.6
_MOST_SHOWN: Final = 60


class SourceLines:
    """Search for source lines of compiled firmware in a run."""

    def __init__(self, recorder: TruthRecorder) -> None:
        self._board = recorder.board
        self._switches = recorder.switches

    def line(self, expectation: object) -> str:
        """Return the place of the statement that an expectation checks, or "" if it is unknown."""
        if self._board.chip is None:
            return ""
        if isinstance(expectation, ExpectLed | ExpectLedFollows):
            return led_place(self._board.chip, self._switches, expectation.led.upper())
        if isinstance(expectation, _Printed) and expectation.pattern is None:
            return self._printed(expectation.number_format().text)
        if isinstance(expectation, ExpectReads | ExpectTicks):
            return self.callback()
        return ""

    def callback(self) -> str:
        """Return the callback's statement that waits, or the callback's first line."""
        if self._board.chip is None:
            return ""
        places = Places(self._board.chip.image)
        waiting = waiting_call(self._board.chip.chip, places)
        start = waiting[0] if waiting is not None else places.address_of(CALLBACK)
        return places.place(start) if start is not None else ""

    def _formats(self) -> Iterator[NumberFormat]:
        """Yield the formats of lines in the lab and in the scenario."""
        yield from map(NamedFormat, FIELDS)
        scenario = self._board.scenario
        for one in scenario.expectations if scenario is not None else ():
            if isinstance(one, _Printed) and one.pattern is None:
                yield one.number_format()

    def _printed(self, wanted: str) -> str:
        """Return the printing statement whose format is most similar."""
        assert self._board.chip is not None
        image = self._board.chip.image
        printed = PrintedLines(image, Places(image), b"")
        others = {one.text for one in self._formats()} - {wanted}
        similar = [
            (_similarity(one, wanted), one) for one in printed.formats if others.isdisjoint(_lines(one))
        ]
        share, found = max(similar, key=lambda one: one[0], default=(0.0, None))
        if found is None or share < _SIMILAR:
            return ""
        place = printed.place(found)
        if not place or share == 1:
            return place
        return f'{place} prints "{found.text.strip()[:_MOST_SHOWN]}"'


def _similarity(one: Format, wanted: str) -> float:
    """Compare all lines of a format, and return the largest similarity, from 0 to 1."""
    return max(SequenceMatcher(None, line, wanted.strip()).ratio() for line in _lines(one))


def _lines(one: Format) -> list[str]:
    return [line.strip() for line in one.text.replace("\r", "\n").split("\n")]
