"""Guides, docstrings, comments, messages and the page are in plain technical English; commit subjects are imperative.

Patterns of a private idiom must occur at most so many times in 10,000 words; pages of well-known projects have such rates.
"""

from __future__ import annotations

import ast
import io
import re
import shutil
import subprocess
import tokenize
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip import native

ROOT = Path(__file__).parents[2]
GENERATED = {"decisions.md"}
PRODUCT = ("emulator", "sensors", "firmware_model", "fcu_emulator")
PATTERNS = {
    "a clause in place of a noun": (
        r"\bwhat (?:is|was|are|were|has|have|had|the|it|they|an?|you|can|does|did|would|will|must|may)\b",
        5,
    ),
    "nobody, somebody, whoever, whatever": (r"\b(?:nobody|somebody|whoever|whatever)\b", 1),
    "stands for is": (r"\bstands?\b", 0.5),
    "look at for read or check": (r"\blook(?:s|ed|ing)? at\b", 2),
    "where for if or when": (r"(?:^|[.;,:] )[Ww]here (?:it|there|an?|the|that|they|no|one)\b", 1),
    "of its own": (r"\bof (?:its|their|your|his|our) own\b", 1),
    "made of, made from": (r"\bmade (?:of|from)\b", 0.5),
    "go on, anew": (r"\b(?:go(?:es|ing)? on|went on|anew)\b", 0.5),
    "is no": (r"\b(?:is|are|was|were) no\b", 2),
}
"""Each pattern with its maximum number of occurrences in 10,000 words."""
REGISTERS = {"registers", "registers.py", "memory_map.py"}
"""Folder and files with the descriptions of registers, in the words of the manuals."""
SUBJECTS_SINCE = "f1e11b6fbbd1584a6c399f6d284c2e1f9a152b89"
"""Commit after which each subject is in the imperative."""
LONGEST_SUBJECT = 72
NOT_IMPERATIVE = re.compile(
    r"(?!Bring\b)(?:An?|The|This|These|All|Every|No|What|How|It|[A-Z]\w*(?:[^e]ed|[^s]s|ing))\b"
)


def product_files() -> Iterator[Path]:
    for folder in PRODUCT:
        yield from sorted((ROOT / folder).rglob("*.py"))


@cache
def guides() -> str:
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages if page.name not in GENERATED)
    return re.sub(r"```.*?```|`[^`]*`", "X", text, flags=re.DOTALL)


@cache
def docstrings() -> str:
    """Return the strings of all files that are statements: docstrings, and descriptions of attributes."""
    found = []
    for path in product_files():
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        statements = (node.value for node in nodes if isinstance(node, ast.Expr))
        found += [str(value.value) for value in statements if isinstance(value, ast.Constant)]
    return "\n".join(found)


@cache
def comments() -> str:
    found = []
    for path in product_files():
        source = io.StringIO(path.read_text(encoding="utf-8"))
        found += [
            token.string
            for token in tokenize.generate_tokens(source.readline)
            if token.type == tokenize.COMMENT
        ]
    for path in native.sources():
        found += re.findall(r"/\*.*?\*/", path.read_text(encoding="utf-8"), re.DOTALL)
    return "\n".join(found)


@cache
def messages() -> str:
    """Return all texts of at least three words that are not docstrings: errors, findings, help, reports."""
    found = []
    for path in product_files():
        if REGISTERS & {path.name, path.parent.name}:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        statements = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        strings = (
            node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in statements
        )
        found += [one.value for one in strings if isinstance(one.value, str) and len(one.value.split()) >= 3]
    return "\n".join(found)


@cache
def labels() -> str:
    """Return the texts of the page of ``fcu web``, and of the scenarios and rubrics that come with it."""
    found = [page.read_text(encoding="utf-8") for page in sorted((ROOT / "web" / "src").glob("*.ts"))]
    found += [file.read_text(encoding="utf-8") for file in sorted((ROOT / "scenarios").rglob("*.toml"))]
    quoted = (re.findall(r'"([^"\n]+)"', text) for text in found)
    return "\n".join(text for texts in quoted for text in texts if len(text.split()) >= 3)


@pytest.mark.parametrize(
    "text_of", [guides, docstrings, comments, messages, labels], ids=lambda one: one.__name__
)
@pytest.mark.parametrize("name", PATTERNS)
def test_discouraged_pattern_is_rare(name: str, text_of: Callable[[], str]) -> None:
    pattern, most = PATTERNS[name]
    text = text_of()
    found = [match.group() for match in re.finditer(pattern, text, re.MULTILINE)]

    assert 10_000 * len(found) / len(text.split()) <= most, found


def subjects() -> list[str]:
    """Return the last hundred commit subjects, or an empty list without a history, as in an archive of the sources."""
    git = shutil.which("git")
    if git is None:
        return []
    command = [git, "log", "--first-parent", "-n", "100", "--format=%s", f"{SUBJECTS_SINCE}..HEAD"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.splitlines()


def test_commit_subjects_are_short_and_imperative() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("no history, as in an archive of the sources")
    found = subjects()

    assert found
    assert [one for one in found if len(one) > LONGEST_SUBJECT or NOT_IMPERATIVE.match(one)] == []


@pytest.mark.parametrize(
    "subject", ["Adds a test", "Added a test", "Fixed it", "Adding it", "The test", "A test"]
)
def test_subject_that_is_not_imperative_is_found(subject: str) -> None:
    assert NOT_IMPERATIVE.match(subject)


@pytest.mark.parametrize(
    "subject", ["Add a test", "Pass the seed", "Feed the watchdog", "Bring it", "Print a line"]
)
def test_imperative_subject_is_accepted(subject: str) -> None:
    assert not NOT_IMPERATIVE.match(subject)
