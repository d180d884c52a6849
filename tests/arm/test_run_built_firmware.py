"""``fcu run FILE`` and ``Board(firmware=FILE)``: use of firmware that was compiled for the chip."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import ClassVar

import pytest

from fcu_emulator import Board, FcuError
from fcu_emulator.emulator.chip.image import load_firmware
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.scenario import check
from fcu_emulator.emulator.trace import DeviceNote
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.hostile_programs import program
from tests.support.words import Words

GOLDEN = Path(__file__).parents[1] / "golden"
FLASH = 0x0800_0000


def fcu(*arguments: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *arguments],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        timeout=120,
        check=False,
    )


def flash_contents(program: str = "solution", bus: str = "I2C2") -> bytes:
    """Return the contents of flash as a programmer reads them."""
    contents = bytearray()
    for segment in load_firmware(prebuilt(program, bus)).segments:
        start = segment.address - FLASH
        contents.extend(b"\xff" * (start - len(contents)))
        contents[start : start + len(segment.data)] = segment.data
    return bytes(contents)


def as_intel_hex(data: bytes) -> str:
    """Return records of 16 bytes, with an extended linear address before every 64 KB."""

    def record(kind: int, address: int, content: bytes) -> str:
        body = bytes((len(content), address >> 8 & 0xFF, address & 0xFF, kind)) + content
        return f":{body.hex().upper()}{-sum(body) & 0xFF:02X}\n"

    lines = []
    for at in range(0, len(data), 16):
        if at % 0x10000 == 0:
            lines.append(record(4, 0, ((FLASH + at) >> 16).to_bytes(2, "big")))
        lines.append(record(0, at & 0xFFFF, data[at : at + 16]))
    return "".join([*lines, record(1, 0, b"")])


def printed(firmware: str | Path, seconds: float = 1.2, wiring: str | None = None) -> bytes:
    board = Board(firmware, wiring=wiring, ideal=True)
    board.run_for(seconds)
    return bytes(board.terminal.read())


def test_first_block_at_desk_equals_stored_output() -> None:
    done = fcu("run", "solution", "--scenario", "desk", "--duration", "1.2s", "--speed", "max")
    first_block = (GOLDEN / "desk.txt").read_bytes()[: len(done.stdout)]
    assert b"Altitude: " in done.stdout
    assert done.stdout == first_block
    assert b"board lab3, firmware solution, scenario desk" in done.stderr
    assert done.returncode == 4  # cut off before the scenario's end: not judged


def test_elf_hex_and_bin_print_same_output(tmp_path: Path) -> None:
    contents = flash_contents()
    (tmp_path / "lab3.bin").write_bytes(contents)
    (tmp_path / "lab3.hex").write_text(as_intel_hex(contents), encoding="ascii")
    text = printed("solution")
    assert text.count(b"\n") > 15
    assert printed(tmp_path / "lab3.bin") == text
    assert printed(str(tmp_path / "lab3.hex")) == text


def test_wiring_follows_firmware_symbols() -> None:
    board = Board(firmware=prebuilt("template", "SPI2"))
    assert board.booted.wiring.name == "fcu001v1"
    assert "hspi2" in board.booted.reason
    assert Board(firmware=prebuilt("template", "I2C2")).booted.wiring.name == "lab3"


@pytest.mark.parametrize("bus", ["I2C2", "SPI2"])
def test_firmware_with_both_handles_gets_wiring_it_uses(tmp_path: Path, bus: str) -> None:
    """The test replaces a name in the symbol table by the other handle's name, which has the same length."""
    other = b"\0hi2c2\0" if bus == "SPI2" else b"\0hspi2\0"
    (tmp_path / "both.elf").write_bytes(prebuilt("solution", bus).read_bytes().replace(b"\0pitch\0", other))
    board = Board(firmware=tmp_path / "both.elf")
    used = {"I2C2": ("lab3", False), "SPI2": ("fcu001v1", True)}[bus]
    assert (board.booted.wiring.name, "SPI2" in board.booted.reason) == used
    assert Board(firmware=tmp_path / "both.elf", wiring="lab3").booted.wiring.name == "lab3"


def test_file_without_symbols_for_spi2_gets_spi2_wiring(tmp_path: Path, words: Words) -> None:
    (tmp_path / "lab3.bin").write_bytes(flash_contents(bus="SPI2"))
    board = Board(firmware=tmp_path / "lab3.bin")
    assert board.booted.wiring.name == "fcu001v1"
    words("run", board.booted.reason)
    assert board.now_s == 0
    board.run_for(1.2)
    assert b"LAB3 Init" in board.terminal.read()


def test_file_without_symbols_for_i2c2_gets_default_wiring(tmp_path: Path) -> None:
    (tmp_path / "lab3.bin").write_bytes(flash_contents())
    board = Board(firmware=tmp_path / "lab3.bin")
    assert (board.booted.wiring.name, board.booted.reason) == ("lab3", "")
    with pytest.raises(KeyError, match="'pitch'"):
        board.variable("pitch")


STORES = """
reset:
    mov32 r0, 0xE000E010       ; SYST_CSR
again:
    adds r1, #1
    str r1, [r0]
    b again
fault:
interrupt:
    b interrupt
"""
FAULTS = """
reset:
    mov32 r0, 0xF0000000       ; no memory
    ldr r1, [r0]
    b reset
fault:
interrupt:
    mrs r0, msp
    ldr r1, [r0, #24]          ; the instruction after it
    adds r1, #2
    str r1, [r0, #24]
    bx lr
"""


@pytest.mark.parametrize("source", [STORES, FAULTS])
def test_search_for_wiring_of_busy_firmware_ends(tmp_path: Path, source: str) -> None:
    """The trial ends after a number of accesses or faults, not after a time that depends on the machine."""

    class Tried(Board):
        ends: ClassVar[list[float]] = []

        def run_for(self, seconds: float) -> None:
            super().run_for(seconds)
            self.ends.append(self.now_s)

    (tmp_path / "busy.bin").write_bytes(program(source))
    board = Tried(firmware=tmp_path / "busy.bin")
    assert (board.booted.wiring.name, board.booted.reason) == ("lab3", "")
    assert 0 < max(Tried.ends) <= 0.1


def test_named_program_exists_for_both_wirings() -> None:
    assert printed("template-arm", wiring="fcu001v1") == printed("template-arm", wiring="lab3")


def test_command_prints_chosen_wiring_and_reason(words: Words) -> None:
    file = str(prebuilt("template", "SPI2"))
    done = fcu("run", file, "--duration", "1.05s", "--speed", "max")
    assert f"board fcu001v1, firmware {file}" in done.stderr.decode()
    words("run", next(line for line in done.stderr.decode().splitlines() if "hspi2" in line))
    assert b"LSM6DSL MEMS Accelerometer initialized" in done.stdout


def test_python_settings_for_built_firmware_cause_warning(tmp_path: Path, words: Words) -> None:
    text = 'schema = 1\nquestion = "?"\nduration = "50ms"\n[firmware_settings]\nmu = 0.1\n'
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    done = fcu("run", "solution", "--scenario", str(tmp_path / "own.toml"))
    words("run", next(line for line in done.stderr.decode().splitlines() if "[firmware_settings]" in line))


def test_misspelt_variable_suggests_near_name() -> None:
    with pytest.raises(KeyError, match=r"'pich'.*'pitch'"):
        Board("solution").variable("pich")


def test_variables_are_read_by_their_c_names() -> None:
    board = Board(firmware="solution", ideal=True)
    board.run_for(1.1)
    assert board.variable("acc").AXIS_Z == 1000
    assert board.variable("pitch") == 0.0
    with pytest.raises(KeyError):
        board.variable("no_such_variable")


@pytest.mark.parametrize("name", ["solutoin", "missing.elf", "somewhere/lab3.hex"])
def test_unknown_firmware_is_refused_in_one_line(name: str) -> None:
    with pytest.raises(InputError) as refused:
        Board(firmware=name)
    assert name in str(refused.value)
    assert "\n" not in str(refused.value)
    done = fcu("run", name)
    assert done.returncode == 2
    assert done.stderr.decode().count("\n") == 1


def test_unique_id_differs_from_board_to_board() -> None:
    """DBGMCU and the 96-bit id at 0x1FFF7A10: RM0368 section 24.1."""
    first, second = (Board(firmware="template-arm", seed=seed) for seed in (1, 2))

    def unique_id(board: Board) -> bytes:
        assert board.chip is not None
        content = board.chip.core.memory(0x1FFF_7A10, 12)
        assert content is not None
        return bytes(content)

    assert unique_id(first) != unique_id(second)
    assert unique_id(first) == unique_id(Board(firmware="template-arm", seed=1))


def test_splitting_run_does_not_change_output() -> None:
    whole, sliced = (Board(firmware="solution", seed=3) for _ in range(2))
    whole.run_for(1.06)
    for step_ps in (1, 7_000_000_003, 490_000_000_000, 123_456_789, 562_876_543_207):
        sliced.run_until_ps(sliced.clock.now_ps + step_ps)
    assert sliced.clock.now_ps == whole.clock.now_ps
    assert sliced.terminal.uart.received() == whole.terminal.uart.received()
    assert list(sliced.trace) == list(whole.trace)


def test_invalid_firmware_file_raises_fcu_error(tmp_path: Path) -> None:
    (tmp_path / "text.elf").write_text("hello, I am a text\n")
    with pytest.raises(FcuError, match=r"text\.elf"):
        Board(firmware=tmp_path / "text.elf")


@pytest.mark.parametrize("scenario", ["led_x", "led_y", "flat"])
def test_scenario_accepts_led_lit_during_pin_setup(scenario: str) -> None:
    """On the real board, too, an LED is lit from the set-up of its pin as an output until it is switched off."""
    board = Board(firmware="solution", scenario=scenario)
    board.run_for(0.15)
    assert not [finding for finding in check(board) if finding.kind == "led"]


def test_reset_does_not_cause_clock_note() -> None:
    board = Board(firmware="solution")
    board.run_for(0.2)
    assert board.chip is not None
    board.chip.core.request_reset("PIN")
    board.run_for(0.2)
    assert len(board.chip.core.resets) == 1
    assert not [note for note in board.trace.of(DeviceNote) if note.device == "USART1"]
