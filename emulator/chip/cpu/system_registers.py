"""Names of the registers in the system control space and the DWT (ARMv7-M ARM B3.2, B3.3, B3.4, C1.8)."""

from __future__ import annotations

from typing import Final

SCS_NAMES: Final[dict[int, str]] = {
    0x004: "ICTR",
    0x010: "SYST_CSR",
    0x014: "SYST_RVR",
    0x018: "SYST_CVR",
    0x01C: "SYST_CALIB",
    **{
        base + 4 * word: f"NVIC_{name}{word}"
        for base, name in (
            (0x100, "ISER"),
            (0x180, "ICER"),
            (0x200, "ISPR"),
            (0x280, "ICPR"),
            (0x300, "IABR"),
        )
        for word in range(3)
    },
    **{0x400 + 4 * word: f"NVIC_IPR{word}" for word in range(22)},
    0xF00: "STIR",
    0x008: "ACTLR",
    0xD00: "CPUID",
    0xD04: "ICSR",
    0xD08: "VTOR",
    0xD0C: "AIRCR",
    0xD10: "SCR",
    0xD14: "CCR",
    0xD18: "SHPR1",
    0xD1C: "SHPR2",
    0xD20: "SHPR3",
    0xD24: "SHCSR",
    0xD28: "CFSR",
    0xD2C: "HFSR",
    0xD30: "DFSR",
    0xD34: "MMFAR",
    0xD38: "BFAR",
    0xD3C: "AFSR",
    0xD88: "CPACR",
    0xDF0: "DHCSR",
    0xDF4: "DCRSR",
    0xDF8: "DCRDR",
    0xDFC: "DEMCR",
    0xF34: "FPCCR",
    0xF38: "FPCAR",
    0xF3C: "FPDSCR",
    0xF40: "MVFR0",
    0xF44: "MVFR1",
}
DWT_NAMES: Final[dict[int, str]] = {0x000: "CTRL", 0x004: "CYCCNT", 0xFB0: "LAR", 0xFB4: "LSR"}
