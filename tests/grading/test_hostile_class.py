"""A submission affects only its own result. A fault of the machine is not a verdict, and is not stored."""

from __future__ import annotations

import csv
import errno
import os
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
import zipfile
from contextlib import closing
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import NotJudgedError
from fcu_emulator.emulator.grading import build as building
from fcu_emulator.emulator.grading.build import Builder, CompileError
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.results import GradedClass
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.submissions import SubmittedSource
from fcu_emulator.firmware_model import arm
from fcu_emulator.firmware_model.arm import prebuilt
from tests.campaigns.attacks import classes
from tests.grading.test_build import builder, needs_compiler, needs_sandbox, sandboxed
from tests.grading.test_grade import RUBRIC, grade, kept, out, rubric, table
from tests.grading.test_gradescope import autograder, run_autograder

__all__ = ["autograder", "builder", "kept", "out", "rubric", "sandboxed"]  # fixtures
SOURCE = b"int main(void) { for (;;) { } }\n"
posix = pytest.mark.skipif(sys.platform == "win32", reason="source is built on Linux and macOS")


@pytest.fixture
def submissions(tmp_path: Path) -> Path:
    """Return a class folder with one submission, the built solution."""
    folder = tmp_path / "submissions"
    (folder / "ada").mkdir(parents=True)
    shutil.copyfile(prebuilt("solution"), folder / "ada" / "lab3.elf")
    return folder


def status(out: Path) -> dict[str, str]:
    return {name: row["status"] for name, row in table(out).items()}


# -- names and archives -------------------------------------------------------------------------------------


def test_zip_entry_without_name_rejects_only_its_submission(
    submissions: Path, rubric: Path, out: Path
) -> None:
    with zipfile.ZipFile(submissions / "eve.zip", "w") as target:
        entry = zipfile.ZipInfo("x")
        entry.filename = ""
        target.writestr(entry, b"int main(void) { return 0; }")

    assert grade(submissions, "--rubric", rubric, "--out", out) == 0
    assert status(out) == {"ada": "judged", "eve": "rejected"}


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names are Unicode")
@pytest.mark.parametrize("option", [[], ["--anonymous"]])
def test_non_utf8_name_gets_escaped_id(submissions: Path, rubric: Path, out: Path, option: list[str]) -> None:
    folder = submissions / os.fsdecode(b"jos\xe9")
    folder.mkdir()
    shutil.copyfile(prebuilt("template"), folder / "lab3.elf")

    assert grade(submissions, "--rubric", rubric, "--out", out, *option) == 0
    assert sorted(row["points"] for row in table(out).values()) == ["1", "3"]
    assert "jos\\udce9" in (table(out) if not option else (out / "kept" / "who-is-who.csv").read_text())


def test_damaged_classes_are_graded_completely(tmp_path: Path) -> None:
    """A part of the campaign ``python -m tests.campaigns.attacks``."""
    from random import Random

    assert sum(1 for _ in classes.archives(300, Random(1), tmp_path)) == 300
    assert sum(1 for _ in classes.names(100, Random(1), tmp_path)) == 100
    assert sum(1 for _ in classes.tables(300, Random(1), tmp_path)) == 300


def test_table_of_pseudonyms_contains_no_formula(
    submissions: Path, rubric: Path, out: Path, tmp_path: Path
) -> None:
    formulas = ['=HYPERLINK("http://x","y")', "+cmd|' /C calc'!A0", "@SUM(1)", "-1+1", "\uff1d1+1"]
    roster = tmp_path / "roster.csv"
    with roster.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([("id", "name"), *((one, one) for one in formulas)])
    grade(submissions, "--rubric", rubric, "--out", out, "--roster", roster, "--anonymous")

    for file in (out / "kept" / "who-is-who.csv", out / "grades.csv"):
        text = file.read_text(encoding="utf-8-sig")
        cells = [cell.strip('"') for line in text.splitlines() for cell in line.split(",")]
        assert not [cell for cell in cells if cell.startswith(("=", "+", "@", "-", "\uff1d"))], file


# -- a machine that fails -----------------------------------------------------------------------------------


def no_space(*args: object, **kwargs: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def no_space_in_a_copy(*args: object, **kwargs: object) -> None:
    raise shutil.Error([("a", "b", "[Errno 28] No space left on device")])


def no_process(*args: object, **kwargs: object) -> None:
    raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))


FAULTS = {
    "a copy": (building.shutil, "copytree", no_space_in_a_copy),
    "a temporary folder": (building, "TemporaryDirectory", no_space),
    "a process": (building.subprocess, "Popen", no_process),
}


@posix
@needs_compiler
@pytest.mark.parametrize("fault", FAULTS)
def test_machine_fault_is_neither_judged_nor_stored(
    fault: str, submissions: Path, rubric: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (submissions / "bob.c").write_bytes(SOURCE)
    options = ["--rubric", rubric, "--out", out, "--build-without-sandbox"]
    with monkeypatch.context() as broken:
        broken.setattr(*FAULTS[fault])
        assert grade(submissions, *options) == 4
    assert status(out) == {"ada": "judged", "bob": "unjudged"}
    assert table(out)["bob"]["points"] == ""
    assert not list((out / "kept").glob("builds/*"))

    assert grade(submissions, *options) == 0
    assert status(out) == {"ada": "judged", "bob": "judged"}


@pytest.mark.parametrize("place", ["scratch", "unpacked"])
def test_full_disk_while_unpacking_is_not_judged(
    place: str, submissions: Path, rubric: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with zipfile.ZipFile(submissions / "bob.zip", "w") as target:
        target.write(prebuilt("template"), "lab3.elf")
    with monkeypatch.context() as broken:
        if place == "scratch":
            broken.setattr("fcu_emulator.emulator.grading.grading.TemporaryDirectory", no_space)
        else:
            broken.setattr("fcu_emulator.emulator.grading.archives.zipfile.ZipFile.open", no_space)
        assert grade(submissions, "--rubric", rubric, "--out", out) == 4
        assert status(out)["bob"] == "unjudged"

    assert grade(submissions, "--rubric", rubric, "--out", out) == 0
    assert status(out)["bob"] == "judged"


def test_unexpected_error_affects_only_one_submission(
    submissions: Path, rubric: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (submissions / "bob.elf").write_bytes(b"x")

    def fail(path: Path, scratch: Path, take: object) -> object:
        if path.name == "bob.elf":
            raise KeyError(path)
        return content(path, scratch, take)

    from fcu_emulator.emulator.grading.submissions import _content as content

    monkeypatch.setattr("fcu_emulator.emulator.grading.submissions._content", fail)

    assert grade(submissions, "--rubric", rubric, "--out", out) == 4
    assert status(out) == {"ada": "judged", "bob": "unjudged"}


# -- a compiler that is killed ------------------------------------------------------------------------------


STRANGE = 'for file in "$@"; do [ -f "$file" ] && grep -q strange "$file"'


def shim(folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Put a compiler on the PATH that runs ``script`` before it compiles."""
    real = shutil.which("arm-none-eabi-gcc")
    (folder / "bin").mkdir(parents=True)
    compiler = folder / "bin" / "arm-none-eabi-gcc"
    ask = 'case "$1" in -print-search-dirs) exit 0;; --version) exec "$real" "$@";; esac'
    compiler.write_text(f'#!/bin/sh\nreal={real}\n{ask}\n{script}\nexec "$real" "$@"\n')
    compiler.chmod(0o755)
    folder.chmod(0o777)
    monkeypatch.setenv("PATH", f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}")
    building._toolchain_of_path.cache_clear()


@pytest.fixture
def fresh_toolchain() -> object:
    yield
    building._toolchain_of_path.cache_clear()


@pytest.fixture
def heeded() -> object:
    """Let programs receive signals, which nohup and background jobs of scripts ignore."""
    known = [getattr(signal, name) for name in ("SIGHUP", "SIGINT", "SIGTERM") if hasattr(signal, name)]
    before = {one: signal.signal(one, signal.SIG_DFL) for one in known}
    yield
    for one, handler in before.items():
        signal.signal(one, handler)


@pytest.mark.usefixtures("fresh_toolchain", "heeded")
@posix
@needs_compiler
@pytest.mark.parametrize("sign", ["KILL", "TERM", "HUP"])
def test_killed_compiler_is_not_compile_error(
    sign: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The compiler is killed each time it compiles this program, and not with other programs."""
    with tempfile.TemporaryDirectory() as folder:  # which user nobody can enter
        Path(folder).chmod(0o755)
        shim(Path(folder), monkeypatch, f"{STRANGE} && kill -{sign} $$; done")
        with closing(Builder(sandbox=False, kept=tmp_path / "kept")) as builder:
            with pytest.raises(NotJudgedError, match=f"SIG{sign}"):
                builder.build(SubmittedSource({"main.c": b"/* strange */\n" + SOURCE}))
            assert builder.build(SubmittedSource({"main.c": SOURCE})).firmware.data
    assert len(list((tmp_path / "kept").glob("*.elf"))) == 1


@pytest.mark.usefixtures("fresh_toolchain")
@posix
@needs_compiler
def test_compiler_that_fails_once_is_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory() as folder:
        shim(
            Path(folder),
            monkeypatch,
            f"{STRANGE} && mkdir {folder}/failed 2>/dev/null && exit 1; done",
        )
        with closing(Builder(sandbox=False)) as builder:
            assert builder.build(SubmittedSource({"main.c": b"/* strange */\n" + SOURCE})).firmware.data
        assert (Path(folder) / "failed").is_dir()


@pytest.mark.usefixtures("fresh_toolchain")
@posix
@needs_compiler
def test_compiler_that_fails_always_is_machine_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory() as folder:
        shim(
            Path(folder),
            monkeypatch,
            f'[ -d {folder}/full ] && echo "cc1: error: No space left on device" >&2 && exit 1',
        )
        with closing(Builder(sandbox=False, kept=tmp_path / "kept")) as builder:
            builder.build(SubmittedSource({"main.c": SOURCE}))
            (Path(folder) / "full").mkdir()
            with pytest.raises(NotJudgedError):
                builder.build(SubmittedSource({"main.c": b"int main(void) { return x; }\n"}))
            (Path(folder) / "full").rmdir()
            with pytest.raises(CompileError):
                builder.build(SubmittedSource({"main.c": b"int main(void) { return x; }\n"}))


@posix
@needs_compiler
def test_source_cannot_forge_fault_of_machine(builder: Builder) -> None:
    """The source prints the messages that a full disk or a killed compiler causes."""
    words = "cc1: fatal error: Killed signal terminated program cc1: No space left on device"
    for source in (f'#error "{words}"\n', f'asm(".print \\"{words}\\"\\n.error \\"x\\"");\n'):
        with pytest.raises(CompileError):
            builder.build(SubmittedSource({"main.c": source.encode()}))


@pytest.mark.parametrize("file", ["/dev/ptmx", "/dev/tty", "/dev/stdin", "/proc/kmsg", "/dev/zero"])
def test_sandbox_has_no_blocking_file(file: str, sandboxed: Builder) -> None:
    with pytest.raises(CompileError) as refused:
        sandboxed.build(SubmittedSource({"main.c": f'#include "{file}"\n'.encode() + SOURCE}))
    assert "No such file" in refused.value.log


@posix
@needs_compiler
def test_gradescope_gives_no_result_when_machine_fails(
    autograder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (autograder / "submission" / "main.c").write_bytes(SOURCE)
    with tempfile.TemporaryDirectory() as broken:
        Path(broken).chmod(0o755)
        make = Path(broken) / "make"
        make.write_text("#!/bin/sh\nkill -KILL $$\n")
        make.chmod(0o755)
        monkeypatch.setenv("PATH", f"{broken}{os.pathsep}{os.environ['PATH']}")
        done = run_autograder(autograder)

    assert done.returncode == 4, done.stderr
    assert not (autograder / "results" / "results.json").exists()


# -- the compiler sees its own files only -------------------------------------------------------------------


@pytest.mark.usefixtures("fresh_toolchain")
@needs_compiler
@needs_sandbox
@pytest.mark.parametrize("kind", ["script", "link", "toolchain"])
def test_home_folder_of_compiler_is_not_exposed(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = Path(shutil.which("arm-none-eabi-gcc") or "")
    compiler = tmp_path / "bin" / real.name
    compiler.parent.mkdir()
    (tmp_path / "secret.h").write_text("#error the answer is 42\n")
    if kind == "script":
        compiler.write_text(f'#!/bin/sh\nexec {real} "$@"\n')
        compiler.chmod(0o755)
    elif kind == "link":
        compiler.symlink_to(real)
    else:
        shutil.copyfile(real.resolve(), compiler)
        compiler.chmod(0o755)
        for name in ("lib/gcc/arm-none-eabi", "lib/arm-none-eabi"):
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).symlink_to(real.resolve().parents[1] / name)
    monkeypatch.setenv("PATH", f"{compiler.parent}{os.pathsep}{os.environ['PATH']}")
    building._toolchain_of_path.cache_clear()
    with closing(Builder()) as builder:
        assert builder.build(SubmittedSource({"main.c": SOURCE})).firmware.data
        with pytest.raises(CompileError) as refused:
            builder.build(SubmittedSource({"main.c": f'#include "{tmp_path}/secret.h"\n'.encode() + SOURCE}))
    assert "the answer" not in refused.value.log
    assert "No such file" in refused.value.log


# -- recorded text ------------------------------------------------------------------------------------------

_RUN = """[run.still.sensors]
quality = "ideal"

[run.still.world]
pitch_deg = { uniform = [-70, 70] }

"""
DRAWN = (
    RUBRIC.replace("[[exercise]]", f"{_RUN}[[exercise]]", 1)
    .replace("value = 1000, tolerance = 150", "truth = true, tolerance = 20")
    .replace("tolerance = 8", "tolerance = 1")
)


@posix
@needs_compiler
def test_recorded_text_gets_no_points_in_another_run(tmp_path: Path) -> None:
    """The student prints the numbers of an earlier report, which are correct for that seed but not the graded seed."""
    rubric = tmp_path / "drawn.toml"
    rubric.write_text(DRAWN, encoding="utf-8")
    folder = tmp_path / "submissions"
    (folder / "eve").mkdir(parents=True)
    shutil.copyfile(prebuilt("solution"), folder / "eve" / "lab3.elf")
    out, salt = tmp_path / "out", tmp_path / "salt.key"
    salt.write_bytes(b"always the same one")
    assert grade(folder, "--rubric", rubric, "--out", out, "--salt", salt) == 0
    first = GradedClass.from_json((out / "grade.json").read_bytes()).submissions[0]
    assert first.points == 3
    assert first.seed is not None
    evidence = judge("solution", load_rubric(rubric), seed=first.seed).evidence[0]
    block = [line for line in evidence.terminal.splitlines() if line.startswith(("ACC", "Pitch"))][-2:]
    program = (arm.sources() / "template" / "main.c").read_text(encoding="utf-8")
    loop = program.index("while (1)") if "while (1)" in program else program.index("for (;;)")
    body = program.index("{", loop) + 1
    text = "".join(f"{line}\\n\\r" for line in block)
    cheat = f'{program[:body]} PRINTF("{text}"); HAL_Delay(200); continue;{program[body:]}'
    (folder / "eve" / "lab3.elf").unlink()
    (folder / "eve" / "main.c").write_text(cheat, encoding="utf-8")
    with closing(Builder(sandbox=False)) as builder:
        built = tmp_path / "cheat.elf"
        built.write_bytes(builder.build(SubmittedSource({"main.c": cheat.encode()})).firmware.data)

    assert judge(built, load_rubric(rubric), seed=first.seed).points == 3
    options = ["--salt", salt, "--build-without-sandbox"]
    assert grade(folder, "--rubric", rubric, "--out", out, *options) == 0
    assert table(out)["eve"]["points"] == "0"


@posix
def test_salt_file_is_created_once_for_owner_only(submissions: Path, rubric: Path, tmp_path: Path) -> None:
    salt = tmp_path / "secret" / "salt.key"
    seeds = []
    for run in ("one", "two"):
        assert grade(submissions, "--rubric", rubric, "--out", tmp_path / run, "--salt", salt) == 0
        whole = GradedClass.from_json((tmp_path / run / "grade.json").read_bytes())
        seeds.append([one.seed for one in whole.submissions])
        assert not (tmp_path / run / "kept" / "salt.key").exists()
    assert seeds[0] == seeds[1]
    assert stat.S_IMODE(salt.stat().st_mode) == 0o600

    assert grade(submissions, "--rubric", rubric, "--out", tmp_path / "three") == 0
    kept = (tmp_path / "three" / "kept" / "salt.key").read_bytes()
    assert kept != salt.read_bytes()
    whole = GradedClass.from_json((tmp_path / "three" / "grade.json").read_bytes())
    assert [one.seed for one in whole.submissions] != seeds[0]
    for path in (tmp_path / "three").rglob("*.*"):
        if path.is_file() and path.name != "salt.key":
            assert kept.hex() not in path.read_text(encoding="utf-8")


@posix
@pytest.mark.parametrize("kind", ["short", "folder", "pipe"])
def test_invalid_salt_file_is_refused(kind: str, submissions: Path, rubric: Path, tmp_path: Path) -> None:
    salt = tmp_path / "salt"
    if kind == "short":
        salt.write_bytes(b"1234")
    elif kind == "folder":
        salt.mkdir()
    else:
        os.mkfifo(salt)

    assert grade(submissions, "--rubric", rubric, "--out", tmp_path / "out", "--salt", salt) == 2


# -- a request to end ---------------------------------------------------------------------------------------


def is_worker(pid: str) -> bool:
    """Return whether a process is a worker. A process that has ended has no command line."""
    try:
        return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


@pytest.mark.usefixtures("heeded")
@pytest.mark.skipif(sys.platform != "linux", reason="children are found in /proc")
@pytest.mark.parametrize("sign", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_signal_ends_workers_and_removes_temporary_folders(
    sign: str, submissions: Path, rubric: Path, tmp_path: Path
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    rubric.write_text(RUBRIC.replace('"1.2s"', '"300s"'), encoding="utf-8")
    arguments = ["grade", submissions, "--rubric", rubric, "--out", tmp_path / "out", "--jobs", "1"]
    process = subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", *map(str, arguments)],
        env={**os.environ, "TMPDIR": str(temporary)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not list(temporary.glob("fcu-work-*/fcu-*/lab3.elf")):
        assert process.poll() is None
        time.sleep(0.01)
    threads = Path(f"/proc/{process.pid}/task").glob("*/children")
    children = " ".join(thread.read_text() for thread in threads).split()
    workers = [pid for pid in children if is_worker(pid)]
    process.send_signal(getattr(signal, sign))
    said = process.communicate(timeout=60)

    assert process.returncode == 130
    assert said[0] == ""
    assert len(said[1].splitlines()) == 1
    assert said[1].startswith("fcu: ")
    assert list(temporary.iterdir()) == []
    assert workers
    assert not [pid for pid in workers if is_worker(pid)]
