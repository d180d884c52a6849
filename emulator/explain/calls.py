"""Functions that a program defines but never calls, although the lab calls them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.image.symbols import Definition

_PAIR_PREFIX, _PAIR_MASK = 0xF000, 0xF800  # of BL and B.W (ARMv7-M ARM A7.7.12, A7.7.18)
_CALL, _JUMP, _SECOND_MASK = 0xD000, 0x9000, 0xD000
_SHORT_JUMP, _SHORT_MASK = 0xE000, 0xF800
_THUMB: Final = 1


@dataclass(frozen=True)
class LabCall:
    """A function that the lab calls in ``caller``. Without this call, the numbers of ``checks`` are wrong."""

    function: str
    caller: str
    checks: frozenset[str]


def never_called(image: FirmwareImage, calls: Iterable[LabCall]) -> Iterator[tuple[LabCall, Diagnosis]]:
    """Yield the functions that the program defines and never calls, in the order of ``calls``.

    A function counts as called if any instruction or word of the image contains its address. Without
    debug information, nothing is yielded.
    """
    symbols = image.symbols
    if symbols is None:
        return
    places, known = Places(image), list(calls)
    for one in known:
        definition, caller = symbols.definition(one.function), places.address_of(one.caller)
        if definition is None or caller is None or _is_called(image, definition):
            continue
        summary = f"{places.place(caller)}: {one.function}() is not called"
        details = (
            f"The program has {one.function}(), but no function calls it. The lab calls it in {one.caller}().",
            *_neighbour(image, places, one, [other for other in known if other.caller == one.caller], caller),
        )
        data = {"function": one.function, "caller": one.caller, **places.line(caller)}
        yield one, Diagnosis("call", summary, details, fatal=False, data=data)


def _neighbour(
    image: FirmwareImage, places: Places, missing: LabCall, calls: Sequence[LabCall], caller: int
) -> Iterator[str]:
    """Yield the place of the call that precedes the missing call in the lab, or else of the call after it."""
    at = calls.index(missing)
    before = [("after", one) for one in reversed(calls[:at])]
    for where, one in [*before, *(("before", one) for one in calls[at + 1 :])]:
        found = places.call_of((one.function,), caller, image.code)
        if found is not None:
            yield f"Call it {where} {one.function}(), {places.place(found[0])}."
            return


def _is_called(image: FirmwareImage, function: Definition) -> bool:
    """Return whether code or data outside of a function contains the function's address."""
    if function.is_inlined:
        return True
    if function.address is None:
        return False
    for segment in image.segments:
        data = np.frombuffer(segment.data[: len(segment.data) & ~1], "<u2").astype(np.int64)
        sources = np.concatenate(
            (_jumps(data, segment.address, function.address), _pointers(data, function.address))
        )
        at = segment.address + 2 * sources
        if np.any((at < function.address) | (at >= function.address + function.size)):
            return True
    return False


def _jumps(data: npt.NDArray[np.int64], begin: int, target: int) -> npt.NDArray[np.int64]:
    """Return the halfwords at which a BL, B.W or B jumps to ``target``."""
    address = begin + 2 * np.arange(len(data))
    first, second = data[:-1], data[1:]
    sign = first >> 10 & 1
    high = ~(second >> 13 ^ sign) & 1, ~(second >> 11 ^ sign) & 1
    offset = (first & 0x3FF) << 12 | (second & 0x7FF) << 1 | high[0] << 23 | high[1] << 22
    long = address[:-1] + 4 + offset - (sign << 24)
    kinds = second & _SECOND_MASK
    is_long = (first & _PAIR_MASK == _PAIR_PREFIX) & ((kinds == _CALL) | (kinds == _JUMP)) & (long == target)
    short = address + 4 + ((data & 0x7FF) << 1) - ((data & 0x400) << 2)
    is_short = (data & _SHORT_MASK == _SHORT_JUMP) & (short == target)
    return np.concatenate((np.flatnonzero(is_long), np.flatnonzero(is_short)))


def _pointers(data: npt.NDArray[np.int64], target: int) -> npt.NDArray[np.int64]:
    words = data[0 : len(data) & ~1 : 2] | data[1 : len(data) & ~1 : 2] << 16
    return 2 * np.flatnonzero(words == target | _THUMB)
