"""The C library: built beside its sources, loaded from there, and messages if it is missing or outdated."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest

from fcu_emulator import emulator
from fcu_emulator.emulator.chip import native
from fcu_emulator.emulator.chip.native import loader
from tests.support.words import Words

ROOT = Path(emulator.__file__).parents[1]
BUILD = Path("building", "library.py")
NATIVE = Path("emulator", "chip", "native")
PACKAGES = "emulator", "firmware_model", "sensors", "scenarios"
SHORT = "--duration", "1.5s", "--speed", "max", "-q"


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a clone without a library."""
    return copied_clone(tmp_path / "clone")


def copied_clone(folder: Path) -> Path:
    """Copy the files of a clone except the library into a new folder."""
    for name in (*PACKAGES, "fcu_emulator", "building"):
        ignored = shutil.ignore_patterns("__pycache__", "generated", native.library_name())
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    for name in ("pyproject.toml", "README.md", "LICENSE", ".gitignore", "llms.txt"):
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "docs", folder / "docs")
    return folder


def files(folder: Path) -> set[str]:
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def new_environment(folder: Path) -> Path:
    """Create a virtual environment with the packages of this one except fcu-emulator; return its folder of programs."""
    venv.create(folder)
    place = {"base": str(folder), "platbase": str(folder)}
    packages = Path(sysconfig.get_path("purelib", "venv", place))
    packages.joinpath("these.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return Path(sysconfig.get_path("scripts", "venv", place))


def run(folder: Path, *arguments: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | environment,
    )


def pip(folder: Path, *arguments: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run pip with the packages that are installed here, and without the network."""
    without = "--no-deps", "--no-index", "--no-build-isolation"
    return run(folder, "-m", "pip", "-q", *arguments, *without, **environment)


def fcu_run(folder: Path, firmware: str) -> subprocess.CompletedProcess[str]:
    return run(folder, "-m", "fcu_emulator", "run", firmware, *SHORT)


def with_library_named(text: str) -> str:
    """Return a text in which the library has the same name on every system."""
    return text.replace(native.library_name(), "LIBRARY")


def test_only_chip_firmware_needs_library(clone: Path, words: Words) -> None:
    file = clone / NATIVE / native.library_name()
    chip, python = fcu_run(clone, "solution"), fcu_run(clone, "lab3")

    assert (chip.returncode, chip.stdout) == (2, "")
    assert chip.stderr.startswith(f"fcu: {file}: ")
    assert chip.stderr.endswith(f" {sys.executable} {clone / BUILD}\n")
    words("run", with_library_named(chip.stderr))
    assert python.returncode == 0
    assert "LAB3 Init..." in python.stdout


def test_build_command_builds_library_exactly_once(clone: Path) -> None:
    file = clone / NATIVE / native.library_name()
    first, second = (run(clone, BUILD) for _ in range(2))
    built_with = native.built_from(file)[1]

    assert first.stdout == f"{file} was built with {built_with}\n"
    assert second.stdout == f"{file} fits its sources\n"
    assert "LAB3 Init..." in fcu_run(clone, "solution").stdout


def test_stale_library_is_refused_until_rebuilt(clone: Path, words: Words) -> None:
    run(clone, BUILD)
    source = clone / NATIVE / "library.c"
    source.write_text(source.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    stale = fcu_run(clone, "solution")
    run(clone, BUILD)

    assert stale.returncode == 2
    words("run", with_library_named(stale.stderr))
    assert fcu_run(clone, "solution").returncode == 0


def test_invalid_library_file_is_refused_in_one_line(clone: Path) -> None:
    mark = f"fcu library [{native.digest()}] built with [nothing] [0]"
    file = clone / NATIVE / native.library_name()
    file.write_text(mark, encoding="utf-8")
    done = fcu_run(clone, "solution")

    assert done.returncode == 2
    assert done.stderr.startswith(f"fcu: {file}: ")
    assert done.stderr.endswith(f" {sys.executable} {clone / BUILD}\n")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("found", ["file:///a%20clone", None])
def test_package_without_library_asks_for_reinstallation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: str | None, words: Words
) -> None:
    class Distribution:
        def read_text(self, name: str) -> str | None:
            assert name == "direct_url.json"
            return found and json.dumps({"url": found, "dir_info": {}})

    monkeypatch.setattr("importlib.metadata.distribution", lambda _name: Distribution())
    problem = loader.problem(tmp_path / NATIVE)
    command = f"{sys.executable} -m pip install --force-reinstall --no-deps {found or 'fcu-emulator'}"
    assert problem.endswith(command)
    words("run", with_library_named(problem.removesuffix(command)))


@pytest.mark.parametrize(
    ("environment", "named"),
    [({"CC": "/no/such/cc"}, "/no/such/cc: "), ({"CC": "cl"}, "unset CC"), ({"CC": "", "PATH": ""}, "(cc;")],
)
def test_failed_library_build_prints_remedy(
    clone: Path, environment: dict[str, str], named: str, words: Words
) -> None:
    done = run(clone, "-S", BUILD, **environment)  # -S: without packages, so without ziglang

    assert done.returncode == 1
    assert named in done.stderr
    words("python", "".join(done.stderr.partition(named)[:2]))
    assert "Traceback" not in done.stderr
    assert not list((clone / NATIVE).glob(native.library_name() + "*"))


@pytest.mark.parametrize("compiler", ["cc", "gcc -O1", "clang"])
def test_editable_installation_uses_compiler_of_environment(
    clone: Path, tmp_path_factory: pytest.TempPathFactory, compiler: str
) -> None:
    if shutil.which(compiler.split(maxsplit=1)[0]) is None:
        pytest.skip(f"needs {compiler.split(maxsplit=1)[0]}")
    bin_folder = new_environment(tmp_path_factory.mktemp("environment"))
    done = pip(clone, "--python", bin_folder / "python", "install", "-e", ".", CC=compiler)
    assert done.returncode == 0, done.stdout + done.stderr

    fcu = str(bin_folder / "fcu")
    ran = subprocess.run([fcu, "run", "solution", *SHORT], capture_output=True, text=True, check=False)
    assert "LAB3 Init..." in ran.stdout
    assert native.built_from(clone / NATIVE / native.library_name())[1] == compiler


def test_wheel_has_library_without_sources_and_solutions(clone: Path, tmp_path: Path) -> None:
    before = files(clone)
    done = pip(clone, "wheel", "-w", tmp_path / "wheel", ".")
    assert done.returncode == 0, done.stdout + done.stderr

    (wheel,) = (tmp_path / "wheel").iterdir()
    assert re.fullmatch(r"fcu_emulator-[\d.]+-py3-none-\w+\.whl", wheel.name)
    inside = {name for name in ZipFile(wheel).namelist() if ".dist-info/" not in name}
    packages = {path for path in before if path.split("/")[0] in PACKAGES}
    sources = {
        path for path in packages if path.startswith(NATIVE.as_posix()) and path.endswith((".c", ".h"))
    }
    solved = {path for path in packages if path.startswith("firmware_model/arm/solution/")}
    assert sources
    assert solved
    expected = packages - sources - solved | {(NATIVE / native.library_name()).as_posix()}
    own = {path for path in before if path.startswith("fcu_emulator/")}
    site = {path.removeprefix("building/site/") for path in before if path.startswith("building/site/")}
    guides = {path for path in before if re.fullmatch(r"docs/[\w-]+\.md|llms\.txt", path)}
    assert inside == {f"fcu_emulator/{path}" for path in expected | guides} | own | site
    assert files(clone) == before
