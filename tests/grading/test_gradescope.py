"""``fcu grade --gradescope-zip``: the archive for Gradescope, and its scripts in Gradescope's folders."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.firmware_model.arm import prebuilt
from tests.grading.test_grade import RUBRIC, SALT, grade, rubric, seed_of
from tests.grading.test_reports import assert_is_gradescopes

__all__ = ["rubric"]  # a fixture
posix_scripts = pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot run shell scripts")


@pytest.fixture
def autograder(tmp_path: Path, rubric: Path) -> Path:
    """Return folders as on Gradescope, with the unpacked archive and the tested fcu."""
    folder = tmp_path / "autograder"
    for name in ("source", "submission", "results"):
        (folder / name).mkdir(parents=True)
    (tmp_path / "salt.key").write_bytes(SALT)
    unpack_autograder(tmp_path, rubric, "--salt", tmp_path / "salt.key")
    metadata = {"id": 1, "users": [{"id": 42, "name": "Bob", "email": "b@x.org"}, {"id": 41, "name": "Ada"}]}
    (folder / "submission_metadata.json").write_text(json.dumps(metadata), encoding="utf-8")
    return folder


def unpack_autograder(tmp_path: Path, rubric: object, *options: object) -> Path:
    """Create the archive and unpack it as Gradescope does, with its folder under ``tmp_path``."""
    source = tmp_path / "autograder" / "source"
    wheel = tmp_path / f"fcu_emulator-{version('fcu-emulator')}-py3-none-any.whl"
    wheel.touch()
    file = tmp_path / "autograder.zip"
    assert grade("--rubric", rubric, "--gradescope-zip", file, "--wheel", wheel, *options) == 0
    with zipfile.ZipFile(file) as archive:
        archive.extractall(source)
        modes = {one.filename: one.external_attr >> 16 for one in archive.infolist()}
    for name in ("setup.sh", "run_autograder"):
        text = (source / name).read_text(encoding="utf-8")
        assert text.startswith("#!/usr/bin/env bash\n"), name
        (source / name).write_text(text.replace("/autograder", str(source.parent)), encoding="utf-8")
        (source / name).chmod(stat.S_IMODE(modes[name]))
    shutil.move(source / "run_autograder", source.parent / "run_autograder")
    return source


def run_autograder(folder: Path) -> subprocess.CompletedProcess[str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        [str(folder / "run_autograder")],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


@posix_scripts
def test_setup_installs_package_and_hides_rubric(autograder: Path) -> None:
    """A script replaces apt-get and venv, and records its calls."""
    source, played = autograder / "source", autograder / "played"
    played.mkdir()
    noting = f'#!/bin/sh\necho "${{0##*/}} $*" >> {played}/calls\n'
    for name in ("apt-get", "python3", "pip"):
        (played / name).write_text(noting, encoding="utf-8")
        (played / name).chmod(0o755)
    setup = source / "setup.sh"
    setup.write_text(setup.read_text(encoding="utf-8").replace("/opt/fcu/bin", str(played)), encoding="utf-8")
    path = f"{played}{os.pathsep}{os.environ['PATH']}"
    subprocess.run([str(setup)], env={**os.environ, "PATH": path}, check=True)
    calls = (played / "calls").read_text(encoding="utf-8").splitlines()

    assert calls[0] == "apt-get update"
    installed = calls[1].split()
    assert installed[:3] == ["apt-get", "install", "-y"]
    assert {"gcc-arm-none-eabi", "libnewlib-arm-none-eabi", "make", "python3-venv"} <= set(installed)
    wheel = f"{source}/fcu_emulator-{version('fcu-emulator')}-py3-none-any.whl"
    assert [call.split() for call in calls[2:]] == [
        ["python3", "-m", "venv", "/opt/fcu"],
        ["pip", "install", wheel],
    ]
    assert stat.S_IMODE(source.stat().st_mode) == 0o700


@posix_scripts
def test_autograder_writes_results_in_its_folders(autograder: Path) -> None:
    shutil.copyfile(prebuilt("template"), autograder / "submission" / "lab3.elf")
    done = run_autograder(autograder)
    results = json.loads((autograder / "results" / "results.json").read_bytes())

    assert done.returncode == 0, done.stderr
    assert_is_gradescopes(results)
    assert [one["score"] for one in results["tests"]] == [1, 0]
    assert [one["visibility"] for one in results["tests"]] == ["visible", "after_due_date"]
    salt = (autograder / "source" / "salt.key").read_bytes()
    seed = seed_of(autograder / "source" / "rubric" / "little.toml", "41", "template", salt)
    assert results["extra_data"]["seed"] == seed


@posix_scripts
@pytest.mark.parametrize(("own_due", "score"), [("2026-11-18T23:00:00-08:00", 0.5), (None, 0.75)])
def test_autograder_subtracts_late_penalty(autograder: Path, own_due: str | None, score: float) -> None:
    with (autograder / "source" / "rubric" / "little.toml").open("a", encoding="utf-8") as rubric:
        rubric.write("[late]\npenalty_per_day = 0.25\n")
    user = {"id": 41, "name": "Ada", "assignment": {"due_date": own_due}}
    times = {
        "created_at": "2026-11-20T09:00:00+01:00",
        "assignment": {"due_date": "2026-11-19T23:00:00-08:00"},
    }
    (autograder / "submission_metadata.json").write_text(json.dumps({"users": [user], **times}))
    shutil.copyfile(prebuilt("template"), autograder / "submission" / "lab3.elf")
    done = run_autograder(autograder)
    results = json.loads((autograder / "results" / "results.json").read_bytes())

    assert done.returncode == 0, done.stderr
    assert_is_gradescopes(results)
    assert (sum(one["score"] for one in results["tests"]), results["score"]) == (1, score)
    assert f"{1 - score:g} points less" in results["output"]


@posix_scripts
def test_autograder_explains_wrong_submission(autograder: Path) -> None:
    (autograder / "submission" / "report.pdf").write_bytes(b"%PDF")
    run_autograder(autograder)
    results = json.loads((autograder / "results" / "results.json").read_bytes())

    assert results["score"] == 0
    assert "hand in main.c" in results["output"]


@posix_scripts
def test_archive_has_files_of_rubric(tmp_path: Path) -> None:
    folder = tmp_path / "course"
    (folder / "more").mkdir(parents=True)
    (folder / "roster.csv").write_text("id\nada\n")
    scenario = "schema = 1\nquestion = 'Why?'\nduration = '1s'\n[[expect]]\nkind = 'no_fault'\n"
    scenario = scenario.partition("[[")[0]
    (folder / "more" / "still.toml").write_text(scenario)
    text = RUBRIC.replace('question = "What is printed?"\nduration = "1.2s"', 'scenario = "more/still.toml"')
    (folder / "mine.toml").write_text(text)
    source = unpack_autograder(tmp_path, folder / "mine.toml")

    assert {path.relative_to(source).as_posix() for path in source.rglob("*") if path.is_file()} == {
        *("setup.sh", "salt.key", "rubric/mine.toml", "rubric/more/still.toml"),
        f"fcu_emulator-{version('fcu-emulator')}-py3-none-any.whl",
    }
    assert load_rubric(source / "rubric" / "mine.toml").digest == load_rubric(folder / "mine.toml").digest


@pytest.mark.parametrize(
    "name", ["fcu_emulator-0.0.1-py3-none-any.whl", "lab.zip", "fcu_emulator-{}-win_amd64.whl"]
)
def test_archive_with_unsuitable_wheel_is_refused(name: str, tmp_path: Path, rubric: Path) -> None:
    wheel = tmp_path / name.format(version("fcu-emulator"))
    wheel.touch()

    assert grade("--rubric", rubric, "--gradescope-zip", tmp_path / "a.zip", "--wheel", wheel) == 2
    assert not (tmp_path / "a.zip").exists()


def test_archive_without_wheel_installs_this_version(tmp_path: Path) -> None:
    assert grade("--rubric", "lab3", "--gradescope-zip", tmp_path / "a.zip") == 0
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert f"fcu-emulator=={version('fcu-emulator')}" in archive.read("setup.sh").decode()
        assert "rubric/lab3.toml" in archive.namelist()
