"""The statements in a firmware's source that switch LEDs.

A statement is found if the LED's pin changed during this statement, or if it calls ``BSP_LED_On()`` or
``BSP_LED_Off()`` with the LED's number. Calls that changed a pin show the LEDs' numbers.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from fcu_emulator.emulator.analysis.led_switches import LedChange, LedSwitches
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK, Backtrace, Places, ReadCode, calls_of
from fcu_emulator.emulator.chip.firmware import ArmFirmware
from fcu_emulator.emulator.chip.image.symbols import FunctionAt

_MOST_SHOWN: Final = 2
_MAIN: Final = "main"
_OWN: Final = (CALLBACK, _MAIN)
"""The student writes the files that define these functions."""
_SWITCHES: Final = {
    True: re.compile(r"led_?on$", re.IGNORECASE),
    False: re.compile(r"led_?off$", re.IGNORECASE),
}
_ANY_SWITCH: Final = re.compile(r"led_?(on|off)$", re.IGNORECASE)
_MOVS_R0, _MOV_W, _HALFWORDS_BACK = 0x20, 0xF04F, 8  # MOVS R0, #imm8; MOV.W (ARMv7-M ARM A7.7.76)


def led_place(arm: ArmFirmware, switches: LedSwitches, led: str) -> str:
    """Return the places that switch a LED: ``main(), main.c:113 (on), main.c:115 (off)``, or ""."""
    statements = _Statements(arm)
    sites = {key: statements.callers(changes) for key, changes in switches.changes.items()}
    numbers: dict[int | None, str] = {
        number: name
        for (name, _), found in sites.items()
        for one in found
        if (number := statements.first_argument(one)) is not None
    }
    unknown = [name for name in arm.signals.board.leds if name not in numbers.values()]
    others = set(statements.first_arguments(_ANY_SWITCH)) - numbers.keys()
    if len(unknown) == len(others) == 1:
        numbers[others.pop()] = unknown[0]
    shown: list[tuple[str, str]] = []
    for lit, word in ((True, "on"), (False, "off")):
        every = [*sites.get((led, lit), ()), *statements.calls(_SWITCHES[lit], numbers, led)]
        shown += [(one, word) for one in statements.shown(every)]
    return _joined(shown)


def _joined(places: Sequence[tuple[str, str]]) -> str:
    """Join places with remarks. Omit a function's name if the previous place is in the same function."""
    parts, before = [], ""
    for place, remark in places:
        function, comma, line = place.partition(", ")
        known = comma and function == before
        parts.append(f"{line if known else place} ({remark})")
        before = function
    return ", ".join(parts)


class _Statements:
    """The statements in the student's files."""

    def __init__(self, arm: ArmFirmware) -> None:
        self.places = Places(arm.image)
        self._code: ReadCode = arm.chip.core.memory
        starts = [one for name in _OWN if (one := self.places.address_of(name)) is not None]
        self._files = {self.places.file(one) for one in starts} - {""}
        symbols = arm.image.symbols
        self._ranges = [] if symbols is None else symbols.code_ranges(self._is_own)

    def _is_own(self, path: str) -> bool:
        return path.replace("\\", "/").rpartition("/")[2] in self._files

    def callers(self, changes: Iterable[LedChange]) -> list[int]:
        """Return the statements that made these changes, the most frequent statement first."""
        found = Counter(site for one in changes if (site := self._caller(one)) is not None)
        return [one for one, _ in found.most_common()]

    def shown(self, sites: Iterable[int]) -> list[str]:
        """Return the statements' places. Omit places in main() (set-up) if there are other places."""
        every = list(dict.fromkeys(sites))
        outside = [one for one in every if self.places.function_name(one) != _MAIN]
        return list(dict.fromkeys(map(self.places.place, outside or every)))[:_MOST_SHOWN]

    def _caller(self, change: LedChange) -> int | None:
        """Return the innermost caller in the student's files at the pin's change, or None."""
        backtrace = Backtrace(self.places, change.word, self._code)
        for call in backtrace.calls(change.pc, change.lr, change.sp):
            if call.interrupted:
                # an interrupt handler made the change; the remaining callers belong to the interrupted code
                return None
            if self.places.file(call.address) in self._files:
                return call.address
        return None

    def calls(self, name: re.Pattern[str], numbers: Mapping[int | None, str], led: str) -> Iterator[int]:
        """Yield calls of functions of this name with the LED's number as first argument."""
        for function in self._functions():
            for site, target in calls_of(function, self._code):
                is_switch = name.search(self.places.function_name(target))
                if is_switch and numbers.get(self.first_argument(site)) == led:
                    yield site

    def first_arguments(self, name: re.Pattern[str]) -> Iterator[int]:
        """Yield constants that are the first argument of a function of this name."""
        for function in self._functions():
            for site, target in calls_of(function, self._code):
                number = self.first_argument(site) if name.search(self.places.function_name(target)) else None
                if number is not None:
                    yield number

    def _functions(self) -> Iterator[FunctionAt]:
        for begin, end in self._ranges:
            address = begin
            while address < end and (function := self.places.function(address)) is not None:
                yield function
                address = max(function.start + function.size, address + 2)

    def first_argument(self, site: int) -> int | None:
        """Return the constant that the instructions before a call move to R0, or None."""
        code = self._code(site - 2 * _HALFWORDS_BACK, 2 * _HALFWORDS_BACK)
        if code is None:
            return None
        halves = [code[at] | code[at + 1] << 8 for at in range(0, len(code), 2)]
        for before, half in zip(reversed(halves[:-1]), reversed(halves[1:]), strict=True):
            if half >> 8 == _MOVS_R0 or (half >> 8 == 0 and before == _MOV_W):
                return half & 0xFF
        return None
