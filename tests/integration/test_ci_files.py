"""The GitHub action and the GitLab template: their schemas, and the script of the action as a runner calls it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
import yaml

from fcu_emulator.firmware_model.arm import prebuilt

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("schema", "file"), [("vendor.github-actions", "action.yml"), ("vendor.gitlab-ci", ".ci/gitlab.yml")]
)
def test_file_fits_schema_of_platform(schema: str, file: str) -> None:
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, str(ROOT / file)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_inputs_of_action_are_not_shell_code() -> None:
    steps = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))["runs"]["steps"]
    assert steps
    assert not [step["run"] for step in steps if "${{" in step.get("run", "")]


@pytest.mark.skipif(os.name != "posix" or shutil.which("bash") is None, reason="the script needs bash")
@pytest.mark.parametrize(("firmware", "code"), [("solution", 0), ("template", 1)])
def test_script_of_action_writes_summary_and_junit(firmware: str, code: int, tmp_path: Path) -> None:
    elf = tmp_path / "my lab.elf"
    shutil.copyfile(prebuilt(firmware), elf)
    program = tmp_path / "bin" / "fcu"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m fcu_emulator "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    files = {name: str(tmp_path / name.lower()) for name in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
    environment = {
        **os.environ,
        **files,
        "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}",
        "RUNNER_TEMP": str(tmp_path),
        "GITHUB_WORKSPACE": str(tmp_path),
        "EXERCISES": "2",
    }
    done = subprocess.run(
        ["bash", str(ROOT / ".ci" / "check.sh"), str(elf)],
        env=environment,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == code, done.stderr
    assert ("::error " in done.stdout) == (code == 1)
    summary = Path(files["GITHUB_STEP_SUMMARY"]).read_text(encoding="utf-8")
    assert summary.startswith("### fcu check\n\n    LAB3")
    assert "::" not in summary
    suites = ET.parse(tmp_path / "fcu-junit.xml").getroot()
    assert {suite.get("failures") for suite in suites} == {"0" if code == 0 else "2"}
    assert "junit=" in Path(files["GITHUB_OUTPUT"]).read_text(encoding="utf-8")
