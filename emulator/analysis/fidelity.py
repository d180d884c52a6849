"""The fidelity table, made from the code.

``python -m emulator.analysis.fidelity docs/fidelity.md`` rewrites it.

What is not modelled comes from the register maps, functions and approximations from the declarations in each
part's folder; nothing is kept by hand, and a test fails when the page is stale.
"""

from __future__ import annotations

import sys
from pathlib import Path

from emulator.errors import InputError
from sensors import PARTS, Part

BEGIN = "<!-- fidelity: made by python -m emulator.analysis.fidelity docs/fidelity.md -->"
END = "<!-- end of fidelity -->"


def table() -> str:
    """The table of all parts as Markdown, without a newline at the end."""
    lines = ["| part | function | documented in | in the model |", "|---|---|---|---|"]
    for part in PARTS.values():
        lines += [
            f"| {part.NAME} | {function.name} | {function.source} | {function.verdict} |"
            for function in part.FUNCTIONS
        ]
        lines.append(f"| {part.NAME} | {_registers(part)} |")
    return "\n".join(lines)


def without_behaviour(part: type[Part]) -> list[str]:
    """Every register and field of a part, banks included, that can be accessed but does nothing."""
    return [name for bank in part.maps().values() for name in bank.without_behaviour()]


def rewrite(text: str) -> str:
    """``text`` with the table between the markers brought up to date; raises InputError without markers."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InputError(f"no place for the fidelity table; put it between {BEGIN} and {END}")
    return f"{before}{BEGIN}\n\n{table()}\n\n{END}{after}"


def _registers(part: type[Part]) -> str:
    count = sum(len(bank.registers) for bank in part.maps().values())
    names = ", ".join(f"`{name}`" for name in without_behaviour(part))
    verdict = f"not modelled, reported when touched: {names}" if names else "modelled"
    return f"{count} registers, every bit | register chapter | {verdict}"


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        page = Path(argument)
        page.write_text(rewrite(page.read_text(encoding="utf-8")), encoding="utf-8")
