"""Dev containers, tasks and launch files: their keys, their commands, and their patterns on real output."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator.emulator.cli.new import create_project

ROOT = Path(__file__).parents[2]
CONTAINER_KEYS = {  # https://containers.dev/implementors/json_reference/
    "name", "build", "containerEnv", "postCreateCommand", "forwardPorts", "portsAttributes", "customizations",
}  # fmt: skip
TASK_KEYS = {  # https://code.visualstudio.com/docs/reference/tasks-appendix
    "label", "type", "command", "group", "problemMatcher", "dependsOn", "isBackground",
}  # fmt: skip
LAUNCH_KEYS = {  # https://code.visualstudio.com/docs/cpp/launch-json-reference
    "name", "type", "request", "MIMode", "miDebuggerPath", "miDebuggerServerAddress", "program", "cwd",
    "stopAtConnect", "preLaunchTask",
}  # fmt: skip


@pytest.fixture
def project(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    create_project(tmp_path / "lab", "I2C2")
    capsys.readouterr()
    return tmp_path / "lab"


def loaded(file: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return content


def tasks(project: Path) -> dict[str, dict[str, Any]]:
    return {task["label"]: task for task in loaded(project / ".vscode" / "tasks.json")["tasks"]}


def test_container_has_documented_keys_and_dockerfile(project: Path) -> None:
    for folder in (project, ROOT):
        container = loaded(folder / ".devcontainer" / "devcontainer.json")
        assert set(container) <= CONTAINER_KEYS
        assert (folder / ".devcontainer" / container["build"]["dockerfile"]).is_file()
        assert container["forwardPorts"] == [8000]


def test_tasks_have_documented_keys_and_known_labels(project: Path) -> None:
    found = tasks(project)
    assert {"fcu build", "fcu run", "fcu check", "fcu web"} <= set(found)
    for task in found.values():
        assert set(task) <= TASK_KEYS
        assert task.get("dependsOn", "fcu build") in found
    (launch,) = loaded(project / ".vscode" / "launch.json")["configurations"]
    assert set(launch) <= LAUNCH_KEYS
    assert launch["preLaunchTask"] in found


def test_commands_of_tasks_have_existing_options(project: Path) -> None:
    for task in tasks(project).values():
        program, command, *arguments = shlex.split(task["command"])
        done = subprocess.run(
            [sys.executable, "-m", "fcu_emulator", command, "--help"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert program == "fcu"
        assert [one for one in arguments if one.startswith("--") and one not in done.stdout] == []


def test_debugger_connects_after_server_is_ready(project: Path) -> None:
    (launch,) = loaded(project / ".vscode" / "launch.json")["configurations"]
    server = tasks(project)[launch["preLaunchTask"]]
    port = launch["miDebuggerServerAddress"].rpartition(":")[2]
    assert f"--gdb {port} --halt" in server["command"]
    command = [sys.executable, "-m", "fcu_emulator", "run", "solution", "--gdb", "0", "--halt"]
    ready = re.compile(server["problemMatcher"]["background"]["endsPattern"])
    with subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8") as board:
        assert board.stderr is not None
        assert next(line for line in board.stderr if ready.search(line))
        board.terminate()


@pytest.mark.parametrize("line", ["        line: main(), main.c:48", "        line: main.c:48"])
def test_matcher_finds_line_of_failed_check(line: str, project: Path) -> None:
    matcher = tasks(project)["fcu check"]["problemMatcher"]["pattern"]
    found = re.search(matcher["regexp"], line)
    assert found
    assert found[matcher["message"]].startswith("line: ")
    assert (found[matcher["file"]], found[matcher["line"]]) == ("main.c", "48")


def test_binder_installs_package_with_tile() -> None:
    assert ".[jupyter]" in (ROOT / ".binder" / "requirements.txt").read_text(encoding="utf-8").splitlines()
    assert "gcc-arm-none-eabi" in (ROOT / ".binder" / "apt.txt").read_text(encoding="utf-8").splitlines()
