"""The LSM6DSL's embedded banks A and B, and rounding of bursts (datasheet 9.1, sections 11 and 12).

Decision: with ROUNDING, a pattern's last address is followed by its first address, wherever the burst starts (AN5040
4.7). FIFO_DATA_OUT always rounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from fcu_emulator.sensors.lsm6dsl import registers
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext
from fcu_emulator.sensors.lsm6dsl.registers import CTRL1_XL, CTRL2_G, CTRL5_C, CTRL7_G, FUNC_CFG_ACCESS
from fcu_emulator.sensors.register import Bits, Register, RegisterMap
from fcu_emulator.sensors.register_file import NEVER_PS, RegisterFile

BANK_A, BANK_B = 0x80, 0xA0  # as selected by FUNC_CFG_ACCESS
_RATE = "read at: 0 every, 1 every 2nd, 2 every 4th, 3 every 8th trigger"
_IRON = "sign in bit 7, magnitude in bits 6 to 0; 1/8 per LSB"


class BankA:
    """Bank A (Table 223, section 11): sensor hub, pedometer, correction of an external magnetometer.

    Decision: the diagonal of the soft-iron matrix resets to 0x08 (1.0) as in Table 223. The zeros of AN5040 7.5.3 would
    remove the field.
    """

    class FUNC_CFG_ACCESS(Register, addr=0x01, reset=0x80):
        """Bank at 0x02 up: 0x00 main, 0x80 bank A, 0xA0 bank B (0x20 alone is forbidden)."""

        FUNC_CFG_EN = Bits(7, doc="1: embedded-function registers, bank A unless FUNC_CFG_EN_B")
        FUNC_CFG_EN_B = Bits(5, doc="1: bank B; only together with FUNC_CFG_EN")

    class SLV0_ADD(Register, addr=0x02):
        """Hub slave 0: I2C address and direction."""

        Slave0_add = Bits(7, 1, doc="7-bit I2C address")
        rw_0 = Bits(0, doc="0 write, 1 read")

    class SLV0_SUBADD(Register, addr=0x03):
        """Hub slave 0: first register."""

        Slave0_reg = Bits(7, 0, doc="sub-address, sent as it is")

    class SLAVE0_CONFIG(Register, addr=0x04):
        """Hub slave 0: rate and length; number of slaves."""

        Slave0_rate = Bits(7, 6, doc=_RATE)
        Aux_sens_on = Bits(5, 4, doc="slaves in use, less one")
        Src_mode = Bits(3, doc="1: read only if the register named by Slave_dataw is not zero")
        Slave0_numop = Bits(2, 0, doc="bytes to read")

    class SLV1_ADD(Register, addr=0x05):
        """Hub slave 1: I2C address."""

        Slave1_add = Bits(7, 1, doc="7-bit I2C address")
        r_1 = Bits(0, doc="1: read enabled")

    class SLV1_SUBADD(Register, addr=0x06):
        """Hub slave 1: first register."""

        Slave1_reg = Bits(7, 0, doc="sub-address, sent as it is")

    class SLAVE1_CONFIG(Register, addr=0x07):
        """Hub slave 1: rate and length; single write of slave 0."""

        Slave1_rate = Bits(7, 6, doc=_RATE)
        write_once = Bits(5, doc="slave 0 is written: 0 at every trigger, 1 once")
        Slave1_numop = Bits(2, 0, doc="bytes to read")

    class SLV2_ADD(Register, addr=0x08):
        """Hub slave 2: I2C address."""

        Slave2_add = Bits(7, 1, doc="7-bit I2C address")
        r_2 = Bits(0, doc="1: read enabled")

    class SLV2_SUBADD(Register, addr=0x09):
        """Hub slave 2: first register."""

        Slave2_reg = Bits(7, 0, doc="sub-address, sent as it is")

    class SLAVE2_CONFIG(Register, addr=0x0A):
        """Hub slave 2: rate and length."""

        Slave2_rate = Bits(7, 6, doc=_RATE)
        Slave2_numop = Bits(2, 0, doc="bytes to read")

    class SLV3_ADD(Register, addr=0x0B):
        """Hub slave 3: I2C address."""

        Slave3_add = Bits(7, 1, doc="7-bit I2C address")
        r_3 = Bits(0, doc="1: read enabled")

    class SLV3_SUBADD(Register, addr=0x0C):
        """Hub slave 3: first register."""

        Slave3_reg = Bits(7, 0, doc="sub-address, sent as it is")

    class SLAVE3_CONFIG(Register, addr=0x0D):
        """Hub slave 3: rate and length."""

        Slave3_rate = Bits(7, 6, doc=_RATE)
        Slave3_numop = Bits(2, 0, doc="bytes to read")

    class DATAWRITE_SRC_MODE_SUB_SLV0(Register, addr=0x0E):
        """Hub slave 0: byte to write, or register tested by Src_mode."""

        Slave_dataw = Bits(7, 0, doc="data byte, or sub-address of the test")

    class CONFIG_PEDO_THS_MIN(Register, addr=0x0F, reset=0x10):
        """Pedometer: internal full scale and smallest step."""

        PEDO_FS = Bits(7, doc="internal full scale: 0 2 g, 1 4 g")
        ths_min = Bits(4, 0, doc="threshold: 32 mg/LSB at 2 g, 62.5 mg/LSB at 4 g")

    class SM_THS(Register, addr=0x13, reset=0x06):
        """Significant motion: steps needed."""

        SM_THS = Bits(7, 0, doc="steps")

    class PEDO_DEB_REG(Register, addr=0x14, reset=0x6E):
        """Pedometer: debounce time and steps."""

        DEB_TIME = Bits(7, 3, doc="80 ms per LSB")
        DEB_STEP = Bits(2, 0, doc="steps before counting starts")

    class STEP_COUNT_DELTA(Register, addr=0x15):
        """Pedometer: delta time."""

        SC_DELTA = Bits(7, 0, doc="1.6384 s per LSB")

    class MAG_SI_XX(Register, addr=0x24, reset=0x08):
        """Soft-iron matrix, row X column X."""

        MAG_SI_XX = Bits(7, 0, doc=_IRON)

    class MAG_SI_XY(Register, addr=0x25):
        """Soft-iron matrix, row X column Y."""

        MAG_SI_XY = Bits(7, 0, doc=_IRON)

    class MAG_SI_XZ(Register, addr=0x26):
        """Soft-iron matrix, row X column Z."""

        MAG_SI_XZ = Bits(7, 0, doc=_IRON)

    class MAG_SI_YX(Register, addr=0x27):
        """Soft-iron matrix, row Y column X."""

        MAG_SI_YX = Bits(7, 0, doc=_IRON)

    class MAG_SI_YY(Register, addr=0x28, reset=0x08):
        """Soft-iron matrix, row Y column Y."""

        MAG_SI_YY = Bits(7, 0, doc=_IRON)

    class MAG_SI_YZ(Register, addr=0x29):
        """Soft-iron matrix, row Y column Z."""

        MAG_SI_YZ = Bits(7, 0, doc=_IRON)

    class MAG_SI_ZX(Register, addr=0x2A):
        """Soft-iron matrix, row Z column X."""

        MAG_SI_ZX = Bits(7, 0, doc=_IRON)

    class MAG_SI_ZY(Register, addr=0x2B):
        """Soft-iron matrix, row Z column Y."""

        MAG_SI_ZY = Bits(7, 0, doc=_IRON)

    class MAG_SI_ZZ(Register, addr=0x2C, reset=0x08):
        """Soft-iron matrix, row Z column Z."""

        MAG_SI_ZZ = Bits(7, 0, doc=_IRON)

    class MAG_OFFX_L(Register, addr=0x2D):
        """Hard-iron offset X, low byte of an int16."""

        MAG_OFFX_L = Bits(7, 0, doc="bits 7 to 0, in LSB of the magnetometer")

    class MAG_OFFX_H(Register, addr=0x2E):
        """Hard-iron offset X, high byte of an int16."""

        MAG_OFFX_H = Bits(7, 0, doc="bits 15 to 8, in LSB of the magnetometer")

    class MAG_OFFY_L(Register, addr=0x2F):
        """Hard-iron offset Y, low byte of an int16."""

        MAG_OFFY_L = Bits(7, 0, doc="bits 7 to 0, in LSB of the magnetometer")

    class MAG_OFFY_H(Register, addr=0x30):
        """Hard-iron offset Y, high byte of an int16."""

        MAG_OFFY_H = Bits(7, 0, doc="bits 15 to 8, in LSB of the magnetometer")

    class MAG_OFFZ_L(Register, addr=0x31):
        """Hard-iron offset Z, low byte of an int16."""

        MAG_OFFZ_L = Bits(7, 0, doc="bits 7 to 0, in LSB of the magnetometer")

    class MAG_OFFZ_H(Register, addr=0x32):
        """Hard-iron offset Z, high byte of an int16."""

        MAG_OFFZ_H = Bits(7, 0, doc="bits 15 to 8, in LSB of the magnetometer")


class BankB:
    """Bank B (Table 224, section 12): absolute wrist tilt.

    Decision: A_WRIST_TILT_Mask resets to 0xC0 as in Table 224. AN5040 6.4 suggests 0x80.
    """

    class FUNC_CFG_ACCESS(Register, addr=0x01, reset=0xA0):
        """Bank at 0x02 up: 0x00 main, 0x80 bank A, 0xA0 bank B (0x20 alone is forbidden)."""

        FUNC_CFG_EN = Bits(7, doc="1: embedded-function registers, bank A unless FUNC_CFG_EN_B")
        FUNC_CFG_EN_B = Bits(5, doc="1: bank B; only together with FUNC_CFG_EN")

    class A_WRIST_TILT_LAT(Register, addr=0x50, reset=0x0F):
        """Wrist tilt: how long the position must be held."""

        WRIST_TILT_TIMER = Bits(7, 0, doc="40 ms per LSB")

    class A_WRIST_TILT_THS(Register, addr=0x54, reset=0x20):
        """Wrist tilt: threshold."""

        WRIST_TILT_THS = Bits(7, 0, doc="15.625 mg per LSB; the angle is asin(value / 64)")

    class A_WRIST_TILT_Mask(Register, addr=0x59, reset=0xC0):
        """Wrist tilt: axes and directions that are detected."""

        WRIST_TILT_MASK_Xpos = Bits(7, doc="1: positive side of X")
        WRIST_TILT_MASK_Xneg = Bits(6, doc="1: negative side of X")
        WRIST_TILT_MASK_Ypos = Bits(5, doc="1: positive side of Y")
        WRIST_TILT_MASK_Yneg = Bits(4, doc="1: negative side of Y")
        WRIST_TILT_MASK_Zpos = Bits(3, doc="1: positive side of Z")
        WRIST_TILT_MASK_Zneg = Bits(2, doc="1: negative side of Z")


# -- access -------------------------------------------------------------------------------------------------

MAIN = RegisterMap.of(registers)
EMBEDDED = {"A": RegisterMap.of(BankA), "B": RegisterMap.of(BankB)}
_TITLES = {"A": "Embedded bank A, selected by FUNC_CFG_ACCESS = 0x80", "B": "... bank B, by 0xA0"}


def titled_maps() -> dict[str, RegisterMap]:
    """Return every register map, keyed by title; the main map's title is empty."""
    return {"": MAIN, **{_TITLES[name]: bank for name, bank in EMBEDDED.items()}}


class Banks:
    """The main bank, and the ``embedded`` banks, keyed by the value of FUNC_CFG_ACCESS."""

    def __init__(self, main: RegisterFile) -> None:
        self.main = main
        self.embedded: Mapping[int, RegisterFile] = {
            BANK_A: RegisterFile(EMBEDDED["A"], version=main.version),
            BANK_B: RegisterFile(EMBEDDED["B"], version=main.version),
        }

    def files(self) -> tuple[RegisterFile, ...]:
        return (self.main, *self.embedded.values())

    def select(self, value: int, now_ps: int) -> RegisterFile:
        if value == FUNC_CFG_ACCESS.FUNC_CFG_EN_B.mask:
            self.main.note(now_ps, "forbidden", "no-bank", "FUNC_CFG_ACCESS = 0x20 selects no bank")
        for registers_ in self.files():  # the register is visible in every bank
            registers_.mem[FUNC_CFG_ACCESS.addr] = value
        return self.embedded.get(value, self.main)


def on_bank_write(
    chip: FeatureContext, bank: int, registers: Iterable[type[Register]], changed: Callable[[int], None]
) -> None:
    """Call ``changed(now_ps)`` after a write to any of ``registers``, after all earlier work.

    If firmware writes to bank A while a sensor is on, a note reports it (AN5040 6).
    """
    mem = chip.registers.mem

    def hook_for(register: type[Register]) -> Callable[[int, int, int], None]:
        def written(old: int, new: int, now_ps: int) -> None:
            del old, new
            measuring = mem[CTRL1_XL.addr] & CTRL1_XL.ODR_XL.mask or mem[CTRL2_G.addr] & CTRL2_G.ODR_G.mask
            if bank == BANK_A and measuring:
                name = register.__name__
                text = f"{name} written while a sensor is on"
                chip.note(now_ps, "forbidden", "changed-while-on", text, register=name)
            chip.catch_up(now_ps)
            changed(now_ps)

        return written

    for register in registers:
        chip.banks[bank].on_write(register, hook_for(register))


# -- rounding of bursts -------------------------------------------------------------------------------------

_ROUNDING: tuple[dict[int, int], ...] = (
    {},
    {0x2D: 0x28},  # accelerometer
    {0x27: 0x22},  # gyroscope
    {0x2D: 0x22},  # gyroscope, accelerometer
    {0x33: 0x2E},  # sensor hub 1 to 6
    {0x33: 0x28},  # accelerometer, sensor hub 1 to 6
    {0x39: 0x22},  # gyroscope, accelerometer, sensor hub 1 to 12
    {0x33: 0x22},  # gyroscope, accelerometer, sensor hub 1 to 6
)
_ROUNDING_STATUS = {0x1E: 0x53, 0x53: 0x1B}  # the three sources, STATUS_REG, FUNC_SRC1


class Rounding:
    """The addresses after which a burst continues at another address, by ROUNDING and ROUNDING_STATUS."""

    CONFIGURATION: tuple[type[Register], ...] = (CTRL5_C, CTRL7_G)

    def __init__(self, chip: FeatureContext) -> None:
        self.active = False
        self._registers = chip.registers
        self._jumps: dict[int, int] = {}

    def configure(self, now_ps: int) -> None:
        del now_ps
        mem = self._registers.mem
        jumps = _ROUNDING[CTRL5_C.ROUNDING.get(mem[CTRL5_C.addr])]
        if mem[CTRL7_G.addr] & CTRL7_G.ROUNDING_STATUS.mask:
            jumps = jumps | _ROUNDING_STATUS
        if jumps != self._jumps:
            self._jumps = jumps
            self._registers.set_jumps(jumps)

    def catch_up(self, now_ps: int) -> None:
        """Do nothing, because rounding does not depend on time."""

    def reset(self, now_ps: int) -> None:
        """Do nothing: ``configure`` reads the registers' reset values."""

    def next_event_ps(self) -> int:
        return NEVER_PS
