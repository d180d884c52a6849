"""Calls of single functions have GCC's arguments and results, and do not change the board."""

from __future__ import annotations

import random
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board, CallError, InputError
from tests.support.arm.call_programs import ABIS, FOLDER, Function, build_elsewhere, functions, value
from tests.support.words import Words

FUNCTIONS = functions()


def started(abi: str = "hard", folder: Path = FOLDER) -> Board:
    board = Board(firmware=folder / f"calls-{abi}.elf")
    board.run_for(0.001)
    return board


@pytest.fixture(scope="module", params=ABIS)
def any_abi(request: pytest.FixtureRequest) -> Board:
    return started(request.param)


@pytest.fixture(scope="module")
def board() -> Board:
    return started()


def plain(read: Any) -> Any:
    """Return structures and arrays as tuples; nested structures and arrays are flattened."""
    if isinstance(read, SimpleNamespace):
        read = tuple(vars(read).values())
    if not isinstance(read, tuple):
        return read
    flat: list[Any] = []
    for item in map(plain, read):
        flat.extend(item if isinstance(item, tuple) else (item,))
    return tuple(flat)


def given_to(one: Function, arguments: list[Any]) -> list[Any]:
    """Nest the values as the C types are nested: a Four is two Pairs, a Five has one array."""
    shapes = {"Four": lambda four: (four[:2], four[2:]), "Five": lambda five: (five,)}
    pairs = zip(one.parameters, arguments, strict=True)
    return [shapes.get(kind, lambda same: same)(argument) for kind, argument in pairs]


@pytest.mark.parametrize("one", FUNCTIONS, ids=lambda one: f"{one.name}({','.join(one.parameters)})")
def test_arguments_and_results_are_passed_as_by_gcc(one: Function, any_abi: Board) -> None:
    chance = random.Random(one.number)
    for _ in range(3):
        arguments = [value(kind, chance) for kind in one.parameters]
        with any_abi.scratch() as copy:
            result = copy.call(one.name, *given_to(one, arguments))
            seen = copy.variable(f"seen{one.number}")

        assert [plain(member) for member in vars(seen).values()] == arguments
        assert plain(result) == arguments[one.result]


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="arm-none-eabi-gcc is not installed")
def test_stored_programs_equal_fresh_build(tmp_path: Path) -> None:
    build_elsewhere(tmp_path)
    board = started("hard", tmp_path)

    assert (tmp_path / "functions.c").read_text() == (FOLDER / "functions.c").read_text()
    assert board.call("faculty", 10) == 3628800


# -- pointers -----------------------------------------------------------------------------------------------


def test_pointer_arguments_take_python_values(board: Board) -> None:
    axes = {"AXIS_X": 1, "AXIS_Y": 2, "AXIS_Z": -10}

    assert board.call("norm1", axes) == -7.0
    assert board.call("norm1", SimpleNamespace(**axes)) == -7.0
    assert board.call("norm1", (1, 2, -10)) == -7.0
    assert board.call("length", "Grüezi") == 7  # UTF-8
    assert board.call("length", b"ab\0c") == 2
    assert board.call("sum", [1, -2, 30], 3) == 29
    assert board.call("sum_of", [(1, 2, 3), axes], 2) == -1


def test_function_writes_into_given_list_or_object(board: Board) -> None:
    axes, whole, numbers = {"AXIS_X": 1, "AXIS_Y": 2, "AXIS_Z": 3}, SimpleNamespace(AXIS_X=5), [1, 2, 3]
    buffer = bytearray(4)
    board.call("negate", axes)
    board.call("negate", whole)
    board.call("doubled", numbers, 3)

    assert axes == {"AXIS_X": -1, "AXIS_Y": -2, "AXIS_Z": -3}
    assert vars(whole) == {"AXIS_X": -5, "AXIS_Y": 0, "AXIS_Z": 0}
    assert numbers == [2, 4, 6]
    assert board.call("fill", buffer, 4) == 4
    assert buffer == b"\1\2\3\4"


def test_address_is_accepted_as_pointer(board: Board) -> None:
    assert board.chip is not None
    assert board.chip.image.symbols is not None
    with board.scratch() as copy:
        copy.set_variable("acc", (1, 2, 3))
        assert copy.call("norm1", board.chip.image.symbols.address_of("acc")) == 6.0


# -- effects ------------------------------------------------------------------------------------------------


def test_call_does_not_change_board() -> None:
    called, left_alone = started(), started()
    for _ in range(3):
        called.call("counted")
        called.call("lights", 0b101)
        called.call("negate", [1, 2, 3])
    for board in (called, left_alone):
        board.run_for(0.01)

    for board in (called, left_alone):
        assert board.chip is not None
    cores = [board.chip.core for board in (called, left_alone) if board.chip]
    assert called.variable("calls") == 0
    assert cores[0].snapshot() == cores[1].snapshot() or bytes(cores[0].ram) == bytes(cores[1].ram)
    assert cores[0].core_state() == cores[1].core_state()
    assert cores[0].retired == cores[1].retired
    assert list(called.trace) == list(left_alone.trace)
    assert called.now_s == left_alone.now_s


def test_call_with_keep_option_changes_board() -> None:
    board = started()

    assert [board.call("counted", keep=True) for _ in range(3)] == [1, 2, 3]
    assert board.variable("calls") == 3
    assert board.call("lights", 0b11, keep=True) == 3
    assert board.chip is not None
    assert board.chip.core.peek(0x4002_0014) == 3
    assert board.variable("calls") == 4
    assert board.call("counted") == 5
    assert board.variable("calls") == 4


def test_scratch_copy_keeps_changes_between_calls(board: Board) -> None:
    with board.scratch() as copy:
        assert [copy.call("counted") for _ in range(2)] == [1, 2]
        copy.set_variable("calls", 10)
        assert copy.call("counted") == 11
    with board.scratch() as copy:
        assert copy.call("counted") == 1


def test_time_passes_for_function_that_waits() -> None:
    board = Board(firmware="solution")
    board.run_for(0.1)
    now_s = board.now_s
    board.call("HAL_Delay", 20)
    assert board.now_s == now_s
    board.call("HAL_Delay", 20, keep=True)
    assert 0.019 <= board.now_s - now_s < 0.022  # ticks of 1 ms, the first one cut


def test_firmware_driver_reads_sensor() -> None:
    board = Board(firmware="solution", ideal=True)
    board.run_for(1.2)
    assert board.chip is not None
    while board.chip.core.handled:  # not in the middle of another transfer
        board.run_for(0.0001)
    acc = [0, 0, 0]
    board.call("ReadSensorRawData", acc, [0, 0, 0], [0, 0, 0], [0.0])

    assert acc == [0, 0, 1000]


# -- what cannot be called ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "arguments", "kind"),
    [
        ("nothin", (), "not_callable"),
        ("acc", (), "not_callable"),
        ("hidden", (1,), "not_callable"),
        ("many", (1,), "variadic"),
        ("faculty", (), "argument_count"),
        ("nothing", (1,), "argument_count"),
        ("faculty", (-1,), "out_of_range"),
        ("faculty", (1.5,), "not_an_integer"),
        ("norm1", ({"AXIS_W": 1},), "unknown_member"),
        ("norm1", ((1, 2),), "not_a_sequence"),
        ("fill", ((1, 2), 2), "unknown_size"),
    ],
)
def test_impossible_call_is_refused_with_reason(
    name: str, arguments: tuple[Any, ...], kind: str, board: Board, words: Words
) -> None:
    with pytest.raises(InputError) as caught:
        board.call(name, *arguments)

    assert caught.value.kind == kind
    words("python", str(caught.value))


@pytest.mark.parametrize(
    ("name", "kind", "where"),
    [
        ("for_ever", "timeout", "for_ever(), "),
        ("until_flag", "timeout", "until_flag()"),
        ("nowhere", "invalid_state", "0x"),
        ("bad_read", "read", "bad_read()"),
        ("undefined", "undefined", "undefined()"),
    ],
)
def test_function_without_return_is_reported_with_location(
    name: str, kind: str, where: str, board: Board, words: Words
) -> None:
    texts = []
    for _ in range(2):  # the board is as it was
        with pytest.raises(CallError) as caught:
            board.call(name, max_instructions=10_000, timeout_s=0.01)
        assert caught.value.kind == kind
        texts.append(str(caught.value))
    assert board.call("faculty", 5) == 120
    assert where in texts[0]
    assert texts[0] == texts[1]
    words("python", texts[0])


def test_call_before_start_up_code_is_refused(words: Words) -> None:
    with pytest.raises(InputError) as caught:
        Board(firmware=FOLDER / "calls-hard.elf").call("nothing")
    assert caught.value.kind == "not_started"
    words("python", str(caught.value))
    with pytest.raises(InputError) as caught:
        Board(firmware="lab3").call("eCompass")
    assert caught.value.kind == "no_chip"


# -- variables ----------------------------------------------------------------------------------------------


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.integers(-(2**31), 2**31 - 1)] * 3), st.integers(0, 255), st.floats())
def test_variable_has_assigned_value(axes: tuple[int, ...], kind: int, number: float) -> None:
    board = _SHARED.setdefault("board", started())
    board.set_variable("acc", axes)
    board.set_variable("mixed", {"kind": kind})
    board.set_variable("mixed", {"value": number})

    assert tuple(vars(board.variable("acc")).values()) == axes
    assert board.variable("mixed").kind == kind
    assert repr(board.variable("mixed").value) == repr(number)


_SHARED: dict[str, Board] = {}


def test_impossible_variable_assignment_is_refused(board: Board) -> None:
    with pytest.raises(InputError, match=r"'acc\.AXIS_Y' must be an integer .*, not 2147483648") as caught:
        board.set_variable("acc", (0, 2**31, 0))
    assert caught.value.kind == "out_of_range"
    with pytest.raises(InputError) as caught:
        board.set_variable("constant", 1)
    assert caught.value.kind == "constant"
    with pytest.raises(KeyError, match="unknown variable"):
        board.set_variable("nope", 1)
