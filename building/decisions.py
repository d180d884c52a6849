"""The index of decisions, made from the modules: python building/decisions.py

A decision is written once, at the top of what it governs, in a paragraph that says "Decision". This script
reads those paragraphs in docstrings and in C's comments, and writes the first sentence of each into
docs/decisions.md, by room, with the file it is in. A test fails when the page is stale.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "docs" / "decisions.md"
ROOMS: Final = ("emulator", "sensors", "firmware_model", "building", "tests")
BEGIN: Final = "<!-- decisions: made by python building/decisions.py -->"
END: Final = "<!-- end of decisions -->"

_DECISION: Final = re.compile(r"\bDecisions?\b(?:,? (?:where|about) [^:]*)?:?\s+(?=\S)")
_COMMENT: Final = re.compile(r"/\*(.*?)\*/", re.DOTALL)
_UNDERLINE: Final = re.compile(r"^[-=]{3,}\s+")
_ITEM: Final = re.compile(r"^[-*] ", re.MULTILINE)
_END: Final = re.compile(r"\.(?= [A-Z]|$)|[;:](?= |$)")
_ROLE: Final = re.compile(r":\w+:`[~!]?([^`]*)`")


def texts(path: Path) -> Iterator[str]:
    """The docstrings of a file in Python, the comments of one in C."""
    source = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        for comment in _COMMENT.findall(source):
            yield re.sub(r"^[ \t]*\*[ ]?", "", comment, flags=re.MULTILINE)
        return
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield ast.get_docstring(node) or ""


def decided(text: str) -> Iterator[str]:
    """The first sentence of each decision; of a list of them, that of each item."""
    for found in _DECISION.finditer(text):
        rest = _UNDERLINE.sub("", text[found.end() :])
        items = []
        for paragraph in rest.split("\n\n"):
            if not _ITEM.match(paragraph):
                break
            items += _ITEM.split(paragraph)[1:]
        yield from map(sentence, items or [rest])


def sentence(text: str) -> str:
    """Up to the first full stop, colon or semicolon outside parentheses, in one line, as Markdown."""
    line = " ".join(text.strip().partition("\n\n")[0].split())
    line = _ROLE.sub(r"`\1`", line).replace("``", "`").replace("|", "\\|")
    for end in _END.finditer(line):
        if line.count("(", 0, end.start()) == line.count(")", 0, end.start()):
            line = line[: end.start()]
            break
    return line[:1].upper() + line[1:]


def index() -> str:
    """The whole index, without a newline at its end."""
    rooms: dict[str, list[str]] = defaultdict(list)
    for path in sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.[pc]*")):
        if path.suffix not in {".py", ".c"} or path == Path(__file__):
            continue
        name = path.relative_to(ROOT)
        for line in dict.fromkeys(line for text in texts(path) for line in decided(text) if line):
            rooms[name.parent.as_posix()].append(f"- {line}. [{name.name}](../{name.as_posix()})")
    return "\n\n".join(f"## {room}\n\n" + "\n".join(lines) for room, lines in sorted(rooms.items()))


def rewrite(page: str) -> str:
    """``page`` with what is between the markers brought up to date."""
    before, _, rest = page.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{index()}\n\n{END}{rest.partition(END)[2]}"


if __name__ == "__main__":
    PAGE.write_text(rewrite(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
