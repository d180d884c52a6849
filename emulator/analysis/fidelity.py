"""Fidelity tables of sensors, chip registers and board, generated from their declarations.

``python -m fcu_emulator.emulator.analysis.fidelity docs/fidelity.md`` rewrites them.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fcu_emulator.emulator.boards.description import BoardErrors
from fcu_emulator.emulator.chip.registers import DECLARED, KINDS
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.sensors import PARTS, Part
from fcu_emulator.sensors.errors import SIGMAS, STRENGTHS, Figure

BEGIN = "<!-- fidelity: made by python -m fcu_emulator.emulator.analysis.fidelity docs/fidelity.md -->"
END = "<!-- end of fidelity -->"
BEGIN_CHIP = "<!-- the chip's registers: made by python -m fcu_emulator.emulator.analysis.fidelity docs/fidelity.md -->"
BEGIN_FIGURES = "<!-- figures: made by python -m fcu_emulator.emulator.analysis.fidelity docs/fidelity.md -->"
END_FIGURES = "<!-- end of figures -->"
END_CHIP = "<!-- end of the chip's registers -->"
BEGIN_BOARD = (
    "<!-- the board itself: made by python -m fcu_emulator.emulator.analysis.fidelity docs/fidelity.md -->"
)
END_BOARD = "<!-- end of the board itself -->"


def table() -> str:
    """Return the table of all sensors as Markdown."""
    lines = ["| part | function | documented in | in the model |", "|---|---|---|---|"]
    for part in PARTS.values():
        lines += [
            f"| {part.NAME} | {function.name} | {function.source} | {function.verdict} |"
            for function in part.FUNCTIONS
        ]
        lines.append(f"| {part.NAME} | {_registers(part)} |")
    return "\n".join(lines)


def chip_table() -> str:
    """Return the table of the chip's registers as Markdown."""
    lines = ["| peripheral | registers | documented in | not modelled |", "|---|---|---|---|"]
    for module in KINDS:
        peripherals = [DECLARED[name] for name in module.INSTANCES]
        count = len({register.name for one in peripherals for register in one.registers})
        names = dict.fromkeys(name for one in peripherals for name in one.without_behaviour())
        missing = ", ".join(f"`{name}`" for name in names) or "nothing"
        lines.append(f"| {', '.join(module.INSTANCES)} | {count} | {module.SOURCE} | {missing} |")
    return "\n".join(lines)


def board_table() -> str:
    """Return the table of a board's draws from its seed."""
    lines = ["| figure | in a real board | unit | source |", "|---|---|---|---|"]
    for name, figure in BoardErrors.figures().items():
        lines.append(f"| `{name}`: {figure.doc} | {figure.size} | {figure.unit} | {figure.source} |")
    return "\n".join(lines)


def figures_table() -> str:
    """Return the deviations of real sensors as Markdown."""
    lines = [
        "| part | figure | in the document | the document | `typical` | `worst` |",
        "|---|---|---|---|---|---|",
    ]
    for part in PARTS.values():
        for figure in part.ERRORS.figures().values():
            if not figure.deviation and not figure.is_strength:
                continue
            what = f"{part.NAME} | {figure.doc}, {figure.unit} | {figure.size} | {figure.source}"
            lines.append(f"| {what} | {_drawn(figure)} |")
    return "\n".join(lines)


def _drawn(figure: Figure) -> str:
    if figure.is_strength:
        return f"{figure.typical:g} | {STRENGTHS['worst'] * figure.typical:g}"
    return f"sigma {figure.sigma:.3g} | +-{SIGMAS * figure.sigma:.3g}"


def without_behaviour(part: type[Part]) -> list[str]:
    """Return every accessible register and field of a sensor that does nothing."""
    return [name for bank in part.maps().values() for name in bank.without_behaviour()]


_TABLES = (
    (BEGIN, END, table),
    (BEGIN_CHIP, END_CHIP, chip_table),
    (BEGIN_FIGURES, END_FIGURES, figures_table),
    (BEGIN_BOARD, END_BOARD, board_table),
)


def rewrite(text: str) -> str:
    """Return ``text`` with updated tables between the markers. Raises InputError without markers."""
    found = False
    for begin, end, made in _TABLES:
        before, opened, rest = text.partition(begin)
        _, closed, after = rest.partition(end)
        if opened and closed:
            text = f"{before}{begin}\n\n{made()}\n\n{end}{after}"
            found = True
    if not found:
        raise InputError(
            f"cannot write the fidelity table: the page must have {BEGIN} and {END}", kind="no_markers"
        )
    return text


def _registers(part: type[Part]) -> str:
    count = sum(len(bank.registers) for bank in part.maps().values())
    names = ", ".join(f"`{name}`" for name in without_behaviour(part))
    verdict = f"not modelled, reported when touched: {names}" if names else "modelled"
    return f"{count} registers, every bit | register chapter | {verdict}"


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        page = Path(argument)
        page.write_text(rewrite(page.read_text(encoding="utf-8")), encoding="utf-8")
