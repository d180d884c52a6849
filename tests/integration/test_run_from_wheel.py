"""``uvx`` and ``pipx run`` run a wheel without an installation, here with a folder of wheels and no network."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.integration.test_library import copied_clone, pip
from tests.support.local_index import needed_by, pack

UV, PIPX = shutil.which("uv"), shutil.which("pipx")
COMMAND = ("fcu", "run", "--scenario", "desk")

pytestmark = pytest.mark.skipif(UV is None and PIPX is None, reason="neither uv nor pipx is installed")


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the wheels of the packages that fcu-emulator needs, and of pip for pipx."""
    folder = tmp_path_factory.mktemp("index")
    for name in (*needed_by("fcu-emulator"), "pip"):
        pack(name, folder)
    return folder


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    done = pip(copied_clone(folder / "clone"), "wheel", "-w", folder, ".")
    assert done.returncode == 0, done.stderr
    (file,) = folder.glob("*.whl")
    return file


def assert_runs_scenario(command: list[str | Path], folder: Path, **settings: str) -> None:
    environment = {
        name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")
    }
    done = subprocess.run(
        [*command, *COMMAND[1:]],
        cwd=folder,
        env=environment | settings,
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )

    assert done.returncode == 0, done.stderr
    assert "LAB3 Init..." in done.stdout
    assert "PASS 8 of 8 expectations met" in done.stderr


@pytest.mark.skipif(UV is None, reason="uv is not installed")
def test_uvx_runs_wheel(wheel: Path, index: Path, tmp_path: Path) -> None:
    assert UV is not None
    offline = ["--offline", "--no-index", "--find-links", index]
    assert_runs_scenario(
        [UV, "tool", "run", *offline, "--python", sys.executable, "--from", wheel, COMMAND[0]],
        tmp_path,
        UV_CACHE_DIR=str(tmp_path / "cache"),
        UV_TOOL_DIR=str(tmp_path / "tools"),
        UV_NO_CONFIG="1",
    )


@pytest.mark.skipif(PIPX is None, reason="pipx is not installed")
def test_pipx_runs_wheel(wheel: Path, index: Path, tmp_path: Path) -> None:
    assert PIPX is not None
    assert_runs_scenario(
        [PIPX, "run", "--python", sys.executable, "--spec", wheel, COMMAND[0]],
        tmp_path,
        PIPX_HOME=str(tmp_path / "pipx"),
        PIPX_BIN_DIR=str(tmp_path / "programs"),
        PIP_NO_INDEX="1",
        PIP_FIND_LINKS=str(index),
        PIP_CONFIG_FILE=os.devnull,
        PIP_NO_CACHE_DIR="1",
    )
