"""Imports follow the layers of the project: they have one direction, and their number is limited.

``sensors`` and ``firmware_model`` import no other package of the project. ``emulator`` imports both, but
``firmware_model`` only where firmware is selected. Each large or special library is imported in one place. Importing
a package never imports a module that Windows does not have.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("sensors", "firmware_model", "emulator")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
NAMES = [path.relative_to(ROOT).as_posix() for path in FILES]

LAYERS = {
    "sensors": {"sensors", "numpy"},
    "firmware_model": {"firmware_model", "numpy"},
}
ONLY_IN = {
    "firmware_model": (
        "emulator/assembly/firmware.py",
        "emulator/cli",
        "emulator/grading/build.py",
        "emulator/grading/copies.py",
        "emulator/testing/",
        "firmware_model/",
    ),
    "hypothesis": ("emulator/testing/",),
    "pytest": ("emulator/testing/", "emulator/grading/pytest_plugin.py"),
    "pydantic": ("emulator/scenario", "emulator/grading/", "emulator/agents/"),
    "mcp": ("emulator/agents/server.py",),
    "mcp_types": ("emulator/agents/server.py",),
    "anyio": ("emulator/agents/server.py",),
    "click": ("emulator/cli",),
    "rich": ("emulator/cli",),
    "vcd": ("emulator/analysis/",),
    "matplotlib": ("emulator/analysis/",),
    "websockets": ("emulator/live/server.py",),
}
ORDER = (
    "sensors",
    "firmware_model",
    "text",
    "errors",
    "renamed",
    "host",
    "clock",
    "trace",
    "world",
    "buses",
    "boards",
    "python_cpu",
    "chip",
    "links",
    "scenario",
    "assembly",
    "emulator",
    "adapters",
    "analysis",
    "explain",
    "live",
    "testing",
    "strategies",
    "grading",
    "agents",
    "cli",
    "__main__",
)
"""Layers from the bottom up. ``emulator`` is the package's own ``__init__``, which exports the board."""
POSIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "termios", "tty"}
LONGEST = 600


class Import(NamedTuple):
    """A module named by an import statement. ``eager``: whether importing the file executes the import."""

    module: str
    eager: bool


@cache
def tree(name: str) -> ast.Module:
    return ast.parse((ROOT / name).read_text(encoding="utf-8"), filename=name)


def dotted(name: str) -> str:
    """Return a path such as ``emulator/links/pty.py`` as ``emulator.links.pty``."""
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


MODULES = {dotted(name): name for name in NAMES}


@cache
def imports(name: str) -> tuple[Import, ...]:
    eager = set(tree(name).body)
    return tuple(
        Import(module, node in eager)
        for node in ast.walk(tree(name))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for module in named(name, node)
    )


def ours(module: str) -> str:
    """Return the name of a module by its folder in the repository; ``fcu_emulator`` is the folder emulator/."""
    return "emulator" if module == "fcu_emulator" else module.removeprefix("fcu_emulator.")


def named(name: str, node: ast.Import | ast.ImportFrom) -> Iterator[str]:
    """Return the module that ``from a import b`` names: a.b if this is a module, otherwise a."""
    if isinstance(node, ast.Import):
        yield from (ours(alias.name) for alias in node.names)
        return
    base = ours(node.module or "")
    if base == "_old_names":  # the former names
        return
    if node.level:
        package = dotted(name).split(".")
        up = node.level - name.endswith("__init__.py")
        base = ".".join([*package[: len(package) - up], *filter(None, [base])])
    for alias in node.names:
        submodule = f"{base}.{alias.name}"
        yield submodule if submodule in MODULES else base


def top(module: str) -> str:
    return module.split(".", maxsplit=1)[0]


def eager_ours(module: str) -> set[str]:
    """Return the modules of the project, with their packages, that an import of ``module`` imports immediately."""
    found = {entry.module for entry in imports(MODULES[module]) if entry.eager and entry.module in MODULES}
    parents = {parent for one in (*found, module) for parent in packages_of(one)}
    return (found | parents) - {module}


def packages_of(module: str) -> Iterator[str]:
    while "." in module:
        module = module.rpartition(".")[0]
        yield module


def reached_from(module: str) -> set[str]:
    """Return all modules of the project that are loaded after an import of ``module``."""
    reached, waiting = set(), [module]
    while waiting:
        one = waiting.pop()
        if one not in reached:
            reached.add(one)
            waiting.extend(eager_ours(one))
    return reached


@pytest.mark.parametrize("package", LAYERS)
def test_lower_layer_imports_only_numpy_and_standard_library(package: str) -> None:
    foreign = {
        (name, entry.module)
        for name in NAMES
        if top(dotted(name)) == package
        for entry in imports(name)
        if top(entry.module) not in LAYERS[package] | sys.stdlib_module_names
    }

    assert not foreign


@pytest.mark.parametrize("library", ONLY_IN)
def test_library_is_imported_only_in_listed_modules(library: str) -> None:
    outside = {
        name
        for name in NAMES
        if not name.startswith(ONLY_IN[library])
        and any(top(entry.module) == library for entry in imports(name))
    }

    assert not outside


def test_packages_import_one_another_in_one_direction() -> None:
    arrows = {
        (top(dotted(name)), top(entry.module))
        for name in NAMES
        for entry in imports(name)
        if top(entry.module) in PACKAGES and top(entry.module) != top(dotted(name))
    }

    assert arrows <= {
        ("emulator", "sensors"),
        ("emulator", "firmware_model"),
    }


def test_imports_have_no_cycles() -> None:
    """Imports inside functions and for type checkers count like all other imports.

    An import of a module in another package also loads the ``__init__`` of that package.
    """
    graph = {module: _needed_by(module) for module in MODULES}
    resting: set[str] = set()
    while removable := {module for module in graph.keys() - resting if graph[module] <= resting}:
        resting |= removable

    assert _circle(graph, graph.keys() - resting) == []


def _needed_by(module: str) -> set[str]:
    named_ones = {entry.module for entry in imports(MODULES[module]) if entry.module in MODULES}
    own_packages = {module, *packages_of(module)}
    packages = {package for one in named_ones for package in packages_of(one)} - own_packages
    return (named_ones | packages) - {module}


def _circle(graph: dict[str, set[str]], among: set[str]) -> list[str]:
    """Return one of the remaining cycles for the message, or nothing if there is none."""
    path: list[str] = []
    one = min(among, default=None)
    while one is not None and one not in path:
        path.append(one)
        one = min(graph[one] & among)
    return path[path.index(one) :] if one is not None else []


def package_or_module(module: str) -> str:
    """Return the package, or the folder or module of the emulator, to which a module belongs."""
    parts = module.split(".")
    return parts[1] if parts[0] == "emulator" and len(parts) > 1 else parts[0]


def test_packages_import_only_lower_packages() -> None:
    """The list has the order of the packages: each package may import earlier packages.

    Imports in functions and for types count.
    """
    upward = {
        (name, entry.module)
        for name in NAMES
        for entry in imports(name)
        if entry.module in MODULES
        and ORDER.index(package_or_module(entry.module)) > ORDER.index(package_or_module(dotted(name)))
    }

    assert upward == set()


def test_import_order_lists_every_package() -> None:
    assert {package_or_module(module) for module in MODULES} == set(ORDER)


@pytest.mark.parametrize("module", [dotted(name) for name in NAMES if name.endswith("__init__.py")])
def test_package_import_needs_no_posix_modules(module: str) -> None:
    needed = {
        (one, entry.module)
        for one in reached_from(module)
        for entry in imports(MODULES[one])
        if entry.eager and top(entry.module) in POSIX_ONLY
    }

    assert not needed


@pytest.mark.parametrize(
    "module", ["emulator", "emulator.cli", "emulator.cli.run", "emulator.assembly.board", "emulator.scenario"]
)
def test_core_is_loaded_only_for_built_firmware(module: str) -> None:
    assert not {one for one in reached_from(module) if one.startswith("emulator.chip.cpu")}


def test_every_file_has_docstring() -> None:
    assert [name for name in NAMES if not (ast.get_docstring(tree(name)) or "").strip()] == []


def test_file_length_is_limited() -> None:
    """A file of the sensors has one chapter of a datasheet and at most 600 lines."""
    lengths = {name: len((ROOT / name).read_text(encoding="utf-8").splitlines()) for name in NAMES}

    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}
