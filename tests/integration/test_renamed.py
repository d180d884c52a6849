"""Names of the previous release: each works, warns, and is in the table of docs/renamed.md."""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.cli.commands import cli
from fcu_emulator.emulator.cli.declare import Command
from fcu_emulator.emulator.live.gestures import OLD_WORDS

PAGE = Path(__file__).parents[2] / "docs" / "renamed.md"
ROWS = re.findall(r"^\| `([^`]+)` \| `([^`]+)` \| (.+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
LINES = {
    "--notes": "run template --duration 1100ms --speed max --notes",
    "--timing": "diff template template --scenario desk --duration 1100ms --timing=5ms",
    "--take": "grade nowhere --rubric lab3 --out out --take firmware",
}


def renamed_options() -> set[tuple[str, str, str]]:
    return {
        (old, new, f"`fcu {name}`")
        for name, command in cli.commands.items()
        if isinstance(command, Command)
        for old, new in command.renamed_options().items()
    }


def test_table_lists_each_renamed_option_and_move() -> None:
    moves = {(old, new, "`fcu move`") for old, new in OLD_WORDS.items()}

    assert set(ROWS) >= renamed_options() | moves
    assert {row for row in ROWS if row[0].startswith("--")} == renamed_options()


@pytest.mark.parametrize(("old", "new", "_where"), [row for row in ROWS if row[0].startswith("--")])
def test_old_option_does_what_the_new_one_does(
    old: str, new: str, _where: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = LINES[old].split()
    codes, outputs, errors = [], [], []
    for words in (line, [re.sub(f"^{old}", new, word) for word in line]):
        codes.append(execute(words))
        printed = capsys.readouterr()
        outputs.append(printed.out)
        errors.append(printed.err.splitlines())

    assert codes[0] == codes[1]
    assert outputs[0] == outputs[1]
    (warning,) = [one for one in errors[0] if old in one]
    assert new in warning
    assert not [one for one in errors[1] if old in one]


def test_words_after_two_dashes_are_not_options() -> None:
    seen: list[str] = []

    @click.command(cls=Command)
    @click.argument("words", nargs=-1)
    def command(words: tuple[str, ...]) -> None:
        seen.extend(words)

    command.main(["--", "--notes"], standalone_mode=False)

    assert seen == ["--notes"]
