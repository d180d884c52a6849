"""The API pages build without a warning, and the examples in the docstrings of these pages run."""

from __future__ import annotations

import importlib
import importlib.metadata
import re
import shutil
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import pytest

from fcu_emulator import emulator
from fcu_emulator.firmware_model.arm import prebuilt

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "api").glob("*.md"))
SHOWN = [
    pytest.param(kind, name, id=name)
    for page in PAGES
    for kind, name in re.findall(
        r"^\.\. auto(\w+):: ([\w.]+)", page.read_text(encoding="utf-8"), re.MULTILINE
    )
]
LITERAL = re.compile(r"::\n\n((?: {4,}.*\n|\n)+)")


def found(name: str) -> object:
    module, _, attribute = name.rpartition(".")
    return getattr(importlib.import_module(module), attribute)


def examples(text: str) -> str:
    """Return the literal blocks with Python code as one program; diagrams are omitted."""
    program = []
    for block in LITERAL.findall(text + "\n"):
        source = textwrap.dedent(block)
        try:
            compile(source, "example", "exec")
        except SyntaxError:
            continue
        program.append(source)
    return "\n".join(program)


@pytest.mark.parametrize(("kind", "name"), SHOWN)
def test_documented_objects_have_docstrings(kind: str, name: str) -> None:
    shown = importlib.import_module(name) if kind == "module" else found(name)

    assert (shown.__doc__ or "").strip()


def test_docs_extra_installs_all_imports_of_pages() -> None:
    """The pages may import packages of other extras only if the extra ``docs`` has these packages, too."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {
        name: {re.split(r"[<>=~;\[ ]", one)[0].lower() for one in packages}
        for name, packages in project["optional-dependencies"].items()
    }
    others = set.union(*extras.values()) - extras["docs"] - {"fcu-emulator"}
    owners = importlib.metadata.packages_distributions()
    hidden = [name for name, owner in owners.items() if others & {one.lower() for one in owner}]
    modules = sorted({name for kind, name in (one.values for one in SHOWN) if kind == "module"})
    program = (
        f"import importlib, sys\nsys.modules.update(dict.fromkeys({hidden!r}))\n"
        f"for name in {modules!r}:\n    importlib.import_module(name)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, check=False)

    assert done.returncode == 0, done.stderr.decode()


@pytest.mark.parametrize(("kind", "name"), SHOWN)
def test_examples_in_docstrings_run(
    kind: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder has a compiled firmware. Docstrings need not import ``Board`` and pytest."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "build").mkdir()
    for file in ("lab3.elf", "build/lab3.elf", "build/mylab.elf"):
        shutil.copyfile(prebuilt("solution", "I2C2"), tmp_path / file)
    shown = importlib.import_module(name) if kind == "module" else found(name)
    program = examples(shown.__doc__ or "")
    names = {"__name__": "example", "Board": emulator.Board, "pytest": pytest}

    exec(compile(program, name, "exec"), names)


def test_public_names_are_on_api_pages() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    whole = re.findall(r"automodule:: ([\w.]+)\n(?!   :no-members:)", text)

    assert [
        name
        for name in emulator.__all__
        if f"emulator.{name}\n" not in text and getattr(emulator, name).__module__ not in whole
    ] == []


def test_every_page_builds_without_warnings(tmp_path: Path) -> None:
    """The command is from CONTRIBUTING: python -m sphinx -W -b html docs build/docs"""
    pytest.importorskip("furo", reason="the documentation's tools are not installed: pip install '.[docs]'")
    pytest.importorskip("myst_parser", reason="the documentation's tools are not installed")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs"]
    done = subprocess.run([*command, str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    board = (tmp_path / "api" / "board.html").read_text(encoding="utf-8")
    assert "run_for" in board
    assert "Run for this much virtual time." in board
