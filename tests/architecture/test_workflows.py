"""Workflows only call commands of the repository and have minimal permissions. Linters accept the folder .github."""

from __future__ import annotations

import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
GITHUB = ROOT / ".github"
FILES = sorted((GITHUB / "workflows").iterdir())
FORMS = sorted(path for path in (GITHUB / "ISSUE_TEMPLATE").iterdir() if path.stem != "config")
TRIGGERS = {"push", "pull_request", "workflow_dispatch"}
"""Permitted triggers.

``pull_request_target`` and ``workflow_run`` are not permitted, because they run with the repository's rights.
"""
PERMISSIONS = {
    "pypa/gh-action-pypi-publish": {"id-token": "write"},
    "actions/deploy-pages": {"id-token": "write", "pages": "write"},
}
"""Permissions by the action that needs them. Other jobs may only read the repository."""
PINNED = re.compile(r"uses: [\w-]+/[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")
SCHEMAS = {
    "vendor.github-workflows": FILES,
    "vendor.github-issue-forms": FORMS,
    "vendor.github-issue-config": [GITHUB / "ISSUE_TEMPLATE" / "config.yml"],
    "vendor.dependabot": [GITHUB / "dependabot.yml"],
    "vendor.citation-file-format": [ROOT / "CITATION.cff"],
}
LINTERS = {
    "actionlint": ["actionlint", *FILES],
    "zizmor": ["zizmor", "--offline", "--no-progress", "--quiet", GITHUB],
    **{name: ["check-jsonschema", "--builtin-schema", name, *files] for name, files in SCHEMAS.items()},
}

workflows = pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)


def loaded(file: Path) -> dict[Any, Any]:
    workflow: dict[Any, Any] = yaml.safe_load(file.read_text(encoding="utf-8"))
    return workflow


def jobs(file: Path) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = loaded(file)["jobs"]
    return found


def actions(job: dict[str, Any]) -> set[str]:
    return {step["uses"].partition("@")[0] for step in job["steps"] if "uses" in step}


def is_in_repository(command: str) -> bool:
    """Return whether a line calls an executable file or a Python program of the repository."""
    program, *arguments = shlex.split(command)
    if program == "python":
        return bool(arguments) and (ROOT / arguments[0]).is_file()
    return "/" in program and os.access(ROOT / program, os.X_OK)


@workflows
def test_commands_of_workflow_are_in_repository(file: Path) -> None:
    commands = [step["run"] for job in jobs(file).values() for step in job["steps"] if "run" in step]

    assert commands
    assert [command for command in commands if "\n" in command or not is_in_repository(command)] == []


@workflows
def test_workflow_is_started_by_usual_events_only(file: Path) -> None:
    events = loaded(file)[True]  # YAML reads "on" as a truth value

    assert set(events) <= TRIGGERS


@workflows
def test_jobs_have_least_permissions(file: Path) -> None:
    default = loaded(file)["permissions"]

    assert default in ({}, {"contents": "read"})
    for job in jobs(file).values():
        needed = [PERMISSIONS[action] for action in actions(job) if action in PERMISSIONS]
        allowed = needed[0] if needed else {"contents": "read"}
        assert len(needed) <= 1
        assert job.get("permissions", default) == allowed


@workflows
def test_jobs_with_write_permission_execute_no_repository_code(file: Path) -> None:
    for job in jobs(file).values():
        if "write" in job.get("permissions", {}).values():
            assert "environment" in job
            assert "actions/checkout" not in actions(job)
            assert not [step for step in job["steps"] if "run" in step]


@workflows
def test_actions_are_pinned_to_commit_and_version(file: Path) -> None:
    lines = [line.strip(" -") for line in file.read_text(encoding="utf-8").splitlines()]
    used = [line for line in lines if line.startswith("uses:")]

    assert used
    assert [line for line in used if not PINNED.fullmatch(line)] == []


@workflows
def test_jobs_have_time_limit_and_keep_no_password(file: Path) -> None:
    for job in jobs(file).values():
        assert job["timeout-minutes"] <= 90
        for step in job["steps"]:
            if step.get("uses", "").startswith("actions/checkout@"):
                assert step["with"]["persist-credentials"] is False


def test_one_workflow_calls_continuous_integration() -> None:
    assert [file.stem for file in FILES if "- run: .ci/run\n" in file.read_text(encoding="utf-8")] == [
        "tests"
    ]


@pytest.mark.parametrize("form", FORMS, ids=lambda file: file.stem)
def test_issue_form_asks_for_version(form: Path) -> None:
    text = form.read_text(encoding="utf-8")

    assert ("fcu --version" in text) is (form.stem != "feature")


@pytest.mark.parametrize("linter", LINTERS)
def test_linter_accepts_files(linter: str) -> None:
    program, *arguments = LINTERS[linter]
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    found = shutil.which(program, path=path)
    if found is None:
        pytest.skip(f"{program} is not installed")
    done = subprocess.run([found, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr


VERSIONED = ("pyproject.toml", "CITATION.cff", "CHANGELOG.md")
problems = runpy.run_path(str(ROOT / "building" / "check_version.py"))["problems"]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    for name in VERSIONED:
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def version_in(folder: Path) -> str:
    (version,) = re.findall(r'^version = "(.+)"$', (folder / "pyproject.toml").read_text(), re.MULTILINE)
    return version


def test_all_files_contain_same_version(copy: Path) -> None:
    version = version_in(copy)

    assert list(problems(copy)) == list(problems(copy, "refs/heads/main")) == []
    assert list(problems(copy, f"refs/tags/v{version}")) == []
    assert len(list(problems(copy, f"refs/tags/{version}"))) == 1


@pytest.mark.parametrize("name", VERSIONED[1:])
def test_file_with_another_version_is_reported(name: str, copy: Path) -> None:
    file = copy / name
    file.write_text(file.read_text(encoding="utf-8").replace(version_in(copy), "99.0"), encoding="utf-8")
    (problem,) = problems(copy)

    assert name in problem
