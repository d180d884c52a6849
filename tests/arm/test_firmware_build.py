"""The shipped ELF files are current builds of the firmware in C, and have the parts that a board needs."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from itertools import product
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from fcu_emulator.firmware_model import arm

COMPILER = "arm-none-eabi-gcc"
FLASH = range(0x0800_0000, 0x0804_0000)  # 256 KB
RAM = range(0x2000_0000, 0x2001_0000)  # 64 KB
LARGEST_FILE = 400_000

VARIANTS = [f"{program}-{bus.lower()}.elf" for program, bus in product(arm.PROGRAMS, arm.BUSES)]
COMMON_SYMBOLS = {"acc", "gyro", "mag", "press", "temperature", "press_zero_level", "huart1", "htim9"}
SOLUTION_SYMBOLS = {"pitch", "roll", "azimuth", "alt", "mag_min", "mag_max"}

variants = pytest.mark.parametrize("name", VARIANTS)
needs_compiler = pytest.mark.skipif(
    shutil.which(COMPILER) is None or shutil.which("make") is None,
    reason=f"{COMPILER} or make is not installed",
)


def shipped(name: str) -> Path:
    return arm.sources() / "prebuilt" / name


def compiler_of(elf: Path) -> str:
    """Return the text of the compiler in .comment: its name and version."""
    with elf.open("rb") as file:
        section = ELFFile(file).get_section_by_name(".comment")
        return str(section.data().rstrip(b"\0").decode()) if section else ""


@cache
def symbols(name: str) -> dict[str, int]:
    with shipped(name).open("rb") as file:
        table = ELFFile(file).get_section_by_name(".symtab")
        assert table is not None
        return {symbol.name: symbol["st_value"] for symbol in table.iter_symbols() if symbol.name}


@pytest.fixture(scope="module")
def rebuilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the four programs from a copy of the sources in another folder."""
    folder = tmp_path_factory.mktemp("firmware")
    for part in ("support", *arm.PROGRAMS):
        shutil.copytree(arm.sources() / part, folder / part)
    shutil.copy(arm.sources() / "Makefile", folder)
    (folder / "prebuilt").mkdir()
    done = subprocess.run(["make", "-j2"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "prebuilt"


@needs_compiler
@variants
def test_shipped_file_equals_fresh_build(name: str, rebuilt: Path) -> None:
    built = rebuilt / name
    if compiler_of(built) != compiler_of(shipped(name)):
        pytest.skip(f"another compiler: {compiler_of(built)}, not {compiler_of(shipped(name))}")

    assert built.read_bytes() == shipped(name).read_bytes()


@variants
def test_program_is_within_chip_memory(name: str) -> None:
    with shipped(name).open("rb") as file:
        elf = ELFFile(file)
        loaded = [segment for segment in elf.iter_segments() if segment["p_type"] == "PT_LOAD"]
        for segment in loaded:
            assert segment["p_paddr"] in FLASH
            assert segment["p_paddr"] + segment["p_filesz"] in FLASH
            assert segment["p_vaddr"] in (FLASH if segment["p_flags"] & 1 else RAM)
        assert elf.header["e_machine"] == "EM_ARM"


@variants
def test_vector_table_starts_program(name: str) -> None:
    """ARMv7-M ARM B1.5.3: word 0 is the stack pointer, word 1 the reset handler with bit 0 set for Thumb."""
    with shipped(name).open("rb") as file:
        table = ELFFile(file).get_section_by_name(".isr_vector")
        assert table is not None
        vectors = [int.from_bytes(table.data()[i : i + 4], "little") for i in range(0, table.data_size, 4)]
        assert table["sh_addr"] == FLASH.start

    assert vectors[0] == symbols(name)["_estack"] == RAM.stop
    assert vectors[1] == symbols(name)["Reset_Handler"]
    assert vectors[1] & 1
    assert vectors[15] == symbols(name)["SysTick_Handler"]
    assert vectors[16 + 24] == symbols(name)["TIM1_BRK_TIM9_IRQHandler"]  # RM0368 table 38, position 24
    assert len(vectors) == 16 + 85


@variants
def test_variables_used_by_debugger_are_in_ram(name: str) -> None:
    needed = COMMON_SYMBOLS | (SOLUTION_SYMBOLS if name.startswith("solution") else set())

    assert needed <= symbols(name).keys()
    assert all(symbols(name)[variable] in RAM for variable in needed)


@variants
def test_symbols_show_bus_of_sensors(name: str) -> None:
    handle, other = ("hspi2", "hi2c2") if "spi2" in name else ("hi2c2", "hspi2")

    assert handle in symbols(name)
    assert other not in symbols(name)


@variants
def test_line_numbers_lead_to_sources(name: str) -> None:
    with shipped(name).open("rb") as file:
        elf = ELFFile(file)
        assert elf.has_dwarf_info()
        names = {Path(unit.get_top_DIE().get_full_path()).name for unit in elf.get_dwarf_info().iter_CUs()}

    assert {
        "main.c",
        "sensor_setup.c",
        "stm32f4xx_hal_i2c.c" if "i2c2" in name else "stm32f4xx_hal_spi.c",
    } <= names


@variants
def test_shipped_file_contains_no_build_paths(name: str) -> None:
    content = shipped(name).read_bytes()

    assert str(arm.sources()).encode() not in content
    assert not re.search(rb"/(tmp|root|Users)/", content)
    assert len(content) < LARGEST_FILE


@pytest.mark.parametrize("arguments", [("lab4", "I2C2"), ("template", "USB")])
def test_unknown_program_or_bus_is_refused(arguments: tuple[str, str]) -> None:
    with pytest.raises(ValueError, match=r"unknown (firmware 'lab4'|sensor bus 'USB'); known: \w+, \w+"):
        arm.prebuilt(*arguments)


def test_every_program_is_found_by_name() -> None:
    found = {arm.prebuilt(program, bus).name for program, bus in product(arm.PROGRAMS, arm.BUSES)}

    assert found == set(VARIANTS)
    assert all(shipped(name).is_file() for name in VARIANTS)
