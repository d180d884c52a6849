"""Why a run of instructions ended."""

from __future__ import annotations

from enum import Enum, auto


class Stop(Enum):
    """What the engine met. All but SLICE, HALT, PLACE and the sleeps ask for an exception of the core."""

    SLICE = auto()  # as many instructions as were asked for, or cut short
    HALT = auto()  # in front of the instruction, for a debugger
    PLACE = auto()  # in front of an instruction that was asked for
    WFI = auto()  # behind the instruction
    WFE = auto()  # behind the instruction
    SVC = auto()  # behind the instruction
    BKPT = auto()  # on the instruction
    EXCEPTION_RETURN = auto()  # an EXC_RETURN value has been loaded into PC
    UNDEFINED = auto()  # on the instruction, as all of the following
    INVALID_STATE = auto()
    NO_COPROCESSOR = auto()
    UNALIGNED = auto()
    DIVIDE_BY_ZERO = auto()
    EXECUTE_NEVER = auto()
    FETCH = auto()
    READ = auto()
    WRITE = auto()
