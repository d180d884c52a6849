"""Untrusted source is built in a sandbox, and compiler errors are shown in safe text."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.build import SANDBOX, Builder, CompileError
from fcu_emulator.emulator.grading.submissions import SubmittedSource
from fcu_emulator.firmware_model import arm
from tests.support.arm import student_programs
from tests.support.words import Words

TEMPLATE = (arm.sources() / "template" / "main.c").read_bytes()


def has_sandbox() -> bool:
    """Return whether bubblewrap is installed and can create a sandbox on this system."""
    if shutil.which(SANDBOX) is None:
        return False
    command = [SANDBOX, "--ro-bind", "/", "/", "--unshare-all", "true"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)
needs_sandbox = pytest.mark.skipif(not has_sandbox(), reason="bubblewrap is not installed, or may not work")


@pytest.fixture(scope="module", params=["open", pytest.param("sandbox", marks=needs_sandbox)])
def builder(request: pytest.FixtureRequest) -> Iterator[Builder]:
    if not student_programs.is_buildable():
        pytest.skip("arm-none-eabi-gcc or make is not installed")
    found = Builder(sandbox=request.param == "sandbox")
    yield found
    found.close()


@pytest.fixture(scope="module")
def sandboxed(builder: Builder) -> Builder:
    if not builder.sandbox:
        pytest.skip("only with a sandbox")
    return builder


def said(builder: Builder, source: bytes) -> str:
    with pytest.raises(CompileError) as refused:
        builder.build(SubmittedSource({"main.c": source}))
    assert all(line.isprintable() for line in refused.value.log.splitlines())
    assert str(refused.value).startswith("does not ")
    return refused.value.log


def test_same_source_gives_same_program(builder: Builder) -> None:
    programs = {builder.build(SubmittedSource({"main.c": TEMPLATE})).firmware.data for _ in range(2)}

    (program,) = programs
    assert program.startswith(b"\x7fELF")
    assert b"/tmp" not in program  # no paths of this machine in the debug information
    assert b"/build" in program


def test_submitted_files_and_headers_are_built_together(builder: Builder) -> None:
    files = {"main.c": b'#include "one.h"\nint main(void) { return one(); }\n', "one.h": b"int one(void);\n"}
    built = builder.build(
        SubmittedSource({**files, "one.c": b'#include "one.h"\nint one(void) { return 1; }\n'})
    )

    assert built.log == ""
    assert "`one'" in said_of(builder, files)


def said_of(builder: Builder, files: dict[str, bytes]) -> str:
    with pytest.raises(CompileError) as refused:
        builder.build(SubmittedSource(files))
    return refused.value.log


def test_compiler_warnings_are_in_build_log(builder: Builder) -> None:
    built = builder.build(SubmittedSource({"main.c": b"int main(void) { int unused; return 0; }\n"}))

    assert built.firmware.data
    assert "main.c:1:22: warning: unused variable 'unused'" in built.log
    assert "/tmp" not in built.log


def test_errors_have_no_paths_of_this_machine(builder: Builder) -> None:
    log = said(builder, b"int main(void) { return x; }\n")

    assert "main.c:1:25: error: 'x' undeclared" in log
    assert "/tmp" not in log
    assert "make" not in log


def test_compiler_error_shows_line_and_column(builder: Builder) -> None:
    log = said_of(builder, {"lab.c": b"int main(void)\n{\n  return pich;\n}\n"})
    lines = log.splitlines()
    number = next(number for number, line in enumerate(lines) if line.startswith("lab.c:3:10: error:"))

    assert "return pich;" in lines[number + 1]
    assert lines[number + 2].rstrip("~").endswith("^")
    assert lines[number + 2].index("^") == lines[number + 1].index("pich")


def test_quoted_source_line_is_not_reported_as_error(builder: Builder) -> None:
    source = b"int f(void) { int a; return 1; } // error: none\nint main(void) { return x; }\n"
    with pytest.raises(CompileError) as refused:
        builder.build(SubmittedSource({"main.c": source}))

    assert "main.c:2:25: error: 'x' undeclared" in str(refused.value)


@pytest.mark.parametrize(
    ("files", "kind", "names"),
    [
        (
            {
                "main.c": b"int main(void) { return 0; }\n",
                "main_old.c": b"int x;\nint main(void) { return 1; }\n",
            },
            "must have one main()",
            ("main.c", "main_old.c"),
        ),
        (
            {
                "main.c": b"int x; int main(void) { return 0; }\n",
                "b.c": b"int x; int main(void) { return 0; }\n",
            },
            "must have one main()",
            ("main.c", "b.c"),
        ),
        (
            {"main.c": b"int x; int main(void) { return 0; }\n", "a.c": b"int x;\n"},
            "does not link",
            ("main.c", "a.c", "x is defined"),
        ),
        (
            {"main.c": b"int one(void);\nint main(void) { return one(); }\n"},
            "does not link",
            ("main.c:2", "one"),
        ),
        ({"main.c": b"int x;\n"}, "must have a main()", ()),
    ],
)
def test_linker_message_is_one_sentence_with_files(
    builder: Builder, files: dict[str, bytes], kind: str, names: tuple[str, ...]
) -> None:
    with pytest.raises(CompileError) as refused:
        builder.build(SubmittedSource(files))
    reason = str(refused.value)

    assert reason.startswith(kind)
    assert all(name in reason for name in names)
    assert not [word for word in ("/usr", "build/", ".o:", "ld:", "collect2") if word in reason]
    assert not [word for word in ("/usr", "/tmp", "collect2") if word in refused.value.log]


def test_control_characters_in_source_are_escaped(builder: Builder) -> None:
    assert "\\x1b[31m" in said(builder, b'#error "\x1b[31m red \xe2\x80\xae"\n')


@pytest.mark.parametrize(
    "source",
    [
        b'#include "/dev/zero"\n',
        b'#include "main.c"\n',
        b"#define A(x) x x x x x x x x x x\nint z = A(A(A(A(A(A(A(A(A(1)))))))));\n",
        b"#define E " + b"-" * 100_000 + b"\nint z = E 1;\n" * 100,
        b'asm(".rept 100000000\\n.word 1\\n.endr");\n',
    ],
)
def test_source_exceeding_limits_is_stopped(source: bytes, builder: Builder) -> None:
    assert len(said(builder, source)) <= 20_000


@pytest.mark.parametrize(
    "source",
    [
        b'#include "/etc/passwd"\n',
        b'asm(".incbin \\"/etc/passwd\\"");\n',
        b'#include "/build/../etc/hosts"\n',
        f'asm(".incbin \\"{Path(__file__).as_posix()}\\"");\n'.encode(),
        f'asm(".incbin \\"{sys.executable}\\"");\n'.encode(),
        b'asm(".incbin \\"/proc/self/environ\\"");\n',
    ],
)
def test_sandbox_has_no_files_of_this_machine(source: bytes, sandboxed: Builder) -> None:
    log = said(sandboxed, source + b"int main(void) { return 0; }\n")

    assert "No such file" in log or "file not found" in log
    assert "root:" not in log


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can be somebody else")
def test_root_without_sandbox_compiles_without_privileges(builder: Builder, tmp_path: Path) -> None:
    secret = tmp_path / "rubric.toml"
    secret.write_text("the answer is 42")
    secret.chmod(0o600)

    assert "the answer" not in said(builder, f'#include "{secret}"\n'.encode())


@needs_compiler
def test_built_programs_are_cached_by_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    good, bad = {"main.c": TEMPLATE}, {"main.c": b"error"}
    with closing(Builder(sandbox=False, kept=tmp_path)) as first:
        built, log = first.build(SubmittedSource(good)), said_of(first, bad)
    monkeypatch.setattr(Builder, "_make", None)  # nothing is compiled any more
    with closing(Builder(sandbox=False, kept=tmp_path)) as second:
        assert second.build(SubmittedSource(good)) == built
        assert said_of(second, bad) == log
        for path in tmp_path.glob("*.elf"):
            path.unlink()
        with pytest.raises(TypeError):
            second.build(SubmittedSource(good))


def test_bus_determines_built_program(builder: Builder) -> None:
    if builder.sandbox:
        pytest.skip("the same with a sandbox")
    source = SubmittedSource({"main.c": TEMPLATE})
    with closing(Builder("SPI2", sandbox=False)) as other:
        assert other.build(source).firmware.data != builder.build(source).firmware.data


@pytest.mark.parametrize(
    ("system", "packages"),
    [
        ("linux", ["gcc-arm-none-eabi", "libnewlib-arm-none-eabi", "make", "bubblewrap"]),
        ("darwin", ["gcc-arm-embedded", "xcode-select"]),
    ],
)
def test_error_for_missing_tools_shows_install_commands(
    monkeypatch: pytest.MonkeyPatch, system: str, packages: list[str], words: Words
) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr(sys, "platform", system)
    with pytest.raises(InputError) as refused:
        Builder()

    assert all(one in str(refused.value) for one in packages)
    assert ("apt" in str(refused.value)) is (system == "linux")
    assert "--build-without-sandbox" in str(refused.value)
    assert "--submission-type firmware" in str(refused.value)
    words("grade", str(refused.value))
