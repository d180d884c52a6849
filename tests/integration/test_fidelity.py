"""The table of docs/fidelity-tables.md is generated from the code and is up to date."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator import InputError
from fcu_emulator.emulator.analysis.fidelity import (
    BEGIN,
    BEGIN_BOARD,
    BEGIN_CHIP,
    END,
    END_BOARD,
    END_CHIP,
    board_table,
    chip_table,
    rewrite,
    table,
)
from fcu_emulator.emulator.boards.description import BoardErrors
from fcu_emulator.emulator.chip.registers import DECLARED
from fcu_emulator.sensors import SENSORS

ROOT = Path(__file__).parents[2]
parts = pytest.mark.parametrize("name", SENSORS)


def fcu(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *arguments], capture_output=True, check=True, timeout=60
    )
    return done.stdout.decode()


def test_table_of_page_is_up_to_date() -> None:
    """If it is outdated: python -m fcu_emulator.emulator.analysis.fidelity docs/fidelity-tables.md"""
    text = (ROOT / "docs" / "fidelity-tables.md").read_text(encoding="utf-8")
    assert rewrite(text) == text


def test_command_rewrites_only_between_markers(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nstale\n{END}\nafter\n", encoding="utf-8")

    subprocess.run(
        [sys.executable, "-m", "fcu_emulator.emulator.analysis.fidelity", str(page)],
        cwd=ROOT,
        check=True,
        timeout=60,
    )

    assert page.read_text(encoding="utf-8") == f"before\n{BEGIN}\n\n{table()}\n\n{END}\nafter\n"


@pytest.mark.parametrize("text", ["", BEGIN, END, f"{END}{BEGIN}"])
def test_page_without_markers_is_refused(text: str) -> None:
    with pytest.raises(InputError) as refused:
        rewrite(text)
    assert refused.value.kind == "no_markers"


def test_page_has_tables_of_sensors_chip_and_board() -> None:
    text = (ROOT / "docs" / "fidelity-tables.md").read_text(encoding="utf-8")
    markers = (BEGIN, END, BEGIN_CHIP, END_CHIP, BEGIN_BOARD, END_BOARD)

    assert all(text.count(marker) == 1 for marker in markers)


def test_board_table_has_every_figure_with_source() -> None:
    rows = board_table().splitlines()[2:]

    assert [row.split("`")[1] for row in rows] == list(BoardErrors.figures())
    (row,) = [row for row in rows if "| +-300 (limit) | mgauss |" in row]
    assert len(row.split("|")[-2]) > 10  # the source


def test_chip_table_lists_peripherals_and_missing_features() -> None:
    rows = {
        name: row for row in chip_table().splitlines() for name in row.split(" | ")[0].strip("| ").split(", ")
    }

    assert DECLARED.keys() <= rows.keys()
    for name, block in DECLARED.items():
        assert all(f"`{missing}`" in rows[name] for missing in block.without_behaviour())


def test_every_row_has_four_cells() -> None:
    for row in [*table().splitlines(), *chip_table().splitlines()]:
        assert row.replace("\\|", "").count("|") == 5, row


@parts
def test_every_function_has_name_and_source(name: str) -> None:
    functions = SENSORS[name].FUNCTIONS
    assert len({function.name for function in functions}) == len(functions)
    assert all(function.name and function.source for function in functions)


@parts
def test_fields_without_behaviour_are_listed(name: str) -> None:
    """For all banks, the table and ``fcu registers`` list the bits that are not modelled in the register maps."""
    names = []
    for bank in SENSORS[name].maps().values():
        for register in bank.registers:
            if not register.modelled:
                names.append(register.__name__)
            else:
                names += [f"{register.__name__}.{bits.name}" for bits in register.fields if not bits.modelled]
    (row,) = [line for line in table().splitlines() if line.startswith(f"| {name} |") and "every bit" in line]
    printed = fcu("registers", name)

    assert [entry.strip("` |") for entry in row.partition("touched: ")[2].split(",")] == (names or [""])
    assert f"reported when used: {', '.join(names) or 'nothing'}\n" in printed
    assert printed.count("(not modelled)") == len(names)


@parts
def test_register_map_shows_every_register_and_field(name: str) -> None:
    printed = fcu("registers", name)
    for title, bank in SENSORS[name].maps().items():
        assert title in printed
        for register in bank.registers:
            assert f"0x{register.addr:02X}" in printed
            assert f" {register.__name__}: " in printed
            assert all(f" {bits.name}: {bits.doc}" in printed for bits in register.fields)


def test_fcu_command_prints_table() -> None:
    assert fcu("registers", "--fidelity") == f"{table()}\n\n{chip_table()}\n"
