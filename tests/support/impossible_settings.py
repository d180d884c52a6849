"""The settings that the documents forbid, with their sources.

LSM6DSL: datasheet DocID028475 Rev 7 and AN5040 Rev 3; LIS2MDL: DocID030621 Rev 3 and AN5069 Rev 2; LPS22HB:
DocID027083 Rev 6.
"""

from __future__ import annotations

from typing import NamedTuple

from tests.support.sensor_fakes import Writes

BANK_A, BANK_B, MAIN = (0x01, 0x80), (0x01, 0xA0), (0x01, 0x00)
XL_104, G_104 = (0x10, 0x40), (0x11, 0x40)
FIFO_BUS = (0x12, 0x44)  # CTRL3_C: BDU and IF_INC
FIFO_ON = (0x0A, 0x26)  # continuous, 104 Hz
FUNC_EN, IRON = (0x19, 0x04), (0x1A, 0x03)  # MASTER_ON and IRON_EN


def slave_0(count: int) -> Writes:
    """Return writes for a sensor hub that reads ``count`` bytes of a LIS2MDL (datasheet 11.2 to 11.4)."""
    return (BANK_A, (0x02, 0x3D), (0x03, 0x68), (0x04, count), MAIN)


class Case(NamedTuple):
    """``before`` is allowed; the last of ``writes`` makes ``setting`` impossible. ``source`` forbids it."""

    part: str
    writes: Writes
    setting: str
    source: str
    before: Writes = ()

    def __str__(self) -> str:
        return f"{self.part}: {self.setting}"


def codes(part: str, address: int, values: range, shift: int, setting: str, source: str) -> list[Case]:
    """Return a case for each reserved code of a field."""
    return [Case(part, ((address, code << shift),), setting, source) for code in values]


CASES = [
    # -- LSM6DSL ------------------------------------------------------------------------------------------
    *codes("LSM6DSL", 0x10, range(12, 16), 4, "CTRL1_XL.ODR_XL", "datasheet T52: not allowed"),
    *codes("LSM6DSL", 0x11, range(11, 16), 4, "CTRL2_G.ODR_G", "datasheet T55: not available"),
    Case("LSM6DSL", ((0x14, 0x03),), "CTRL5_C.ST_XL", "datasheet T64: not allowed"),
    Case("LSM6DSL", ((0x14, 0x08),), "CTRL5_C.ST_G", "datasheet T63: not allowed"),
    Case("LSM6DSL", ((0x12, 0x85),), "CTRL3_C", "AN5040 5.7"),
    Case("LSM6DSL", ((0x01, 0x20),), "FUNC_CFG_ACCESS", "datasheet T22: forbidden"),
    *(
        Case("LSM6DSL", ((address, 0x80),), f"{axis}_OFS_USR", "datasheet 9.91 to 9.93: -127 to 127")
        for axis, address in zip("XYZ", (0x73, 0x74, 0x75), strict=True)
    ),
    Case(
        "LSM6DSL",
        ((0x17, 0x14),),
        "CTRL8_XL.HP_REF_MODE",
        "AN5040 3.7",
    ),
    Case(
        "LSM6DSL",
        ((0x16, 0xC0),),
        "CTRL7_G.HP_EN_G",
        "AN5040 3.8",
        before=((0x11, 0x50),),
    ),
    Case(
        "LSM6DSL",
        ((0x58, 0x88), (0x59, 0x02)),
        "TAP_THS_6D.TAP_THS",
        "AN5040 5.5",
        before=(XL_104, (0x5B, 0x08)),
    ),
    Case(
        "LSM6DSL",
        ((0x58, 0xA0),),
        "TAP_CFG.INACT_EN",
        "AN5040 5.6",
        before=((0x10, 0xA0),),
    ),
    *(
        Case(
            "LSM6DSL",
            ((0x15, mode << 5),),
            f"TRIG_EN, LVL1_EN, LVL2_EN = {mode:03b}b",
            "AN5040 4.8",
        )
        for mode in (1, 5, 7)
    ),
    Case(
        "LSM6DSL",
        ((0x13, 0x80), (0x15, 0x80)),
        "CTRL4_C.DEN_XL_EN",
        "AN5040 4.8",
        before=((0x17, 0x80), XL_104),
    ),
    # -- its FIFO
    *(
        Case(
            "LSM6DSL",
            ((0x0A, mode),),
            f"FIFO_CTRL5.FIFO_MODE = {mode}",
            "datasheet 9.8",
            before=(FIFO_BUS,),
        )
        for mode in (2, 5, 7)
    ),
    *(
        Case("LSM6DSL", ((0x0A, rate << 3),), "FIFO_CTRL5.ODR_FIFO", "datasheet 9.8")
        for rate in range(11, 16)
    ),
    Case(
        "LSM6DSL",
        ((0x07, 0x88), FIFO_ON),
        "FIFO_CTRL2.FIFO_TEMP_EN",
        "AN5040 8",
        before=(FIFO_BUS, XL_104),
    ),
    Case(
        "LSM6DSL",
        ((0x08, 0x09), (0x09, 0x40), FIFO_ON),
        "FIFO_CTRL4.ONLY_HIGH_DATA",
        "AN5040 8",
        before=(FIFO_BUS, XL_104),
    ),
    Case(
        "LSM6DSL",
        ((0x09, 0x80), FIFO_ON),
        "FIFO_CTRL4.STOP_ON_FTH",
        "AN5040 8",
        before=(FIFO_BUS, XL_104),
    ),
    Case("LSM6DSL", (FIFO_ON,), "CTRL3_C.BDU", "AN5040 8", before=(XL_104,)),
    Case(
        "LSM6DSL",
        ((0x08, 0x01),),
        "FIFO",
        "datasheet 5.5",
        before=(FIFO_BUS, XL_104, FIFO_ON),
    ),
    # -- its embedded functions
    Case(
        "LSM6DSL",
        ((0x19, 0x14),),
        "CTRL10_C",
        "AN5040 6",
        before=((0x10, 0x10),),
    ),
    Case(
        "LSM6DSL",
        ((0x19, 0x14),),
        "CONFIG_PEDO_THS_MIN.PEDO_FS",
        "AN5040 6.1",
        before=(BANK_A, (0x0F, 0x90), MAIN, XL_104),
    ),
    Case(
        "LSM6DSL",
        ((0x19, 0x14),),
        "PEDO_DEB_REG.DEB_TIME",
        "datasheet 11.18",
        before=(BANK_A, (0x14, 0x06), MAIN, XL_104),
    ),
    Case(
        "LSM6DSL",
        ((0x19, 0x14),),
        "STEP_COUNT_DELTA",
        "datasheet 11.19",
        before=(BANK_A, (0x15, 0x01), MAIN, XL_104),
    ),
    Case(
        "LSM6DSL",
        (BANK_B, (0x54, 0x40)),
        "A_WRIST_TILT_THS",
        "AN5040 6.4",
        before=(XL_104, (0x19, 0x84)),
    ),
    Case(
        "LSM6DSL",
        (BANK_A, (0x14, 0x68)),
        "PEDO_DEB_REG",
        "AN5040 6",
        before=(XL_104,),
    ),
    # -- its sensor hub
    Case(
        "LSM6DSL",
        ((0x1A, 0x05),),
        "PASS_THROUGH_MODE",
        "AN5040 7.3",
        before=(FUNC_EN, XL_104),
    ),
    Case(
        "LSM6DSL",
        (IRON,),
        "MASTER_CONFIG.IRON_EN",
        "AN5040 7.5",
        before=(*slave_0(5), FUNC_EN, XL_104),
    ),
    Case(
        "LSM6DSL",
        ((0x18, 0x04), (0x1A, 0x01)),
        "CTRL9_XL.SOFT_EN",
        "AN5040 7.5",
        before=(*slave_0(6), FUNC_EN, XL_104),
    ),
    # -- LIS2MDL ------------------------------------------------------------------------------------------
    Case("LIS2MDL", ((0x60, 0x63),), "SOFT_RST", "AN5069 7"),
    *(
        Case(
            "LIS2MDL",
            ((0x60, mode),),
            "COMP_TEMP_EN",
            "datasheet 8.5: must be 1",
        )
        for mode in (0x00, 0x01)
    ),
    Case("LIS2MDL", ((0x61, 0x10),), "OFF_CANC_ONE_SHOT", "AN5069 8"),
    *(Case("LIS2MDL", ((0x62, 0x04 | pin),), "4WSPI", "AN5069 Rev 4") for pin in (0x01, 0x40)),
    # -- LPS22HB ------------------------------------------------------------------------------------------
    *codes("LPS22HB", 0x10, range(6, 8), 4, "CTRL_REG1.ODR", "datasheet T17"),
    Case("LPS22HB", ((0x14, 0xA0),), "FIFO_CTRL.F_MODE", "datasheet 9.8: reserved"),
    Case(
        "LPS22HB",
        ((0x1A, 0x01),),
        "RES_CONF.LC_EN",
        "datasheet 9.14",
        before=((0x10, 0x10),),
    ),
    Case(
        "LPS22HB",
        ((0x11, 0x11),),
        "CTRL_REG2.ONE_SHOT",
        "datasheet 9.6",
        before=((0x10, 0x10),),
    ),
]
