"""System control block (ARMv7-M ARM B3.2, PM0214 4.4); offsets in the system control space."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "PM0214 4.4, 4.6"
INSTANCES = ("SCB",)


class ACTLR(Word, addr=0x008):
    """Auxiliary control."""

    DISOOFP = Bits(9, modelled=False, doc="no floating-point out of order")
    DISFPCA = Bits(8, modelled=False, doc="no automatic CONTROL.FPCA")
    DISFOLD = Bits(2, modelled=False, doc="no folding of IT")
    DISDEFWBUF = Bits(1, modelled=False, doc="no write buffer")
    DISMCYCINT = Bits(0, modelled=False, doc="no interruption of LDM and STM")


class CPUID(Word, addr=0xD00, access="r", reset=0x410F_C241):
    """Processor identity."""

    IMPLEMENTER = Bits(31, 24, doc="ARM")
    VARIANT = Bits(23, 20, doc="r0")
    ARCHITECTURE = Bits(19, 16, doc="ARMv7-M")
    PARTNO = Bits(15, 4, doc="Cortex-M4")
    REVISION = Bits(3, 0, doc="p1")


class ICSR(Word, addr=0xD04, reset=0x800):
    """Interrupt control and state."""

    NMIPENDSET = Bits(31, doc="NMI is pending")
    PENDSVSET = Bits(28, doc="PendSV is pending")
    PENDSVCLR = Bits(27, access="w", doc="clears the pending bit of PendSV")
    PENDSTSET = Bits(26, doc="SysTick is pending")
    PENDSTCLR = Bits(25, access="w", doc="clears the pending bit of SysTick")
    ISRPREEMPT = Bits(
        23, access="r", modelled=False, doc="a pending exception is taken on leaving debug state"
    )
    ISRPENDING = Bits(22, access="r", doc="an interrupt is pending")
    VECTPENDING = Bits(20, 12, access="r", doc="the most urgent pending exception")
    RETTOBASE = Bits(11, access="r", doc="no exception is active besides the current one")
    VECTACTIVE = Bits(8, 0, access="r", doc="the exception being handled")


class VTOR(Word, addr=0xD08):
    """Vector table offset."""

    TBLOFF = Bits(29, 7, doc="address of the vector table")


class AIRCR(Word, addr=0xD0C, reset=0xFA05_0000):
    """Application interrupt and reset control."""

    VECTKEY = Bits(31, 16, doc="must be 0x05FA, otherwise the write is ignored")
    ENDIANNESS = Bits(15, access="r", doc="little-endian")
    PRIGROUP = Bits(10, 8, doc="number of subpriority bits, minus one")
    SYSRESETREQ = Bits(2, access="w", doc="resets the chip")
    VECTCLRACTIVE = Bits(1, access="w", doc="makes all exceptions inactive; for debuggers")
    VECTRESET = Bits(0, access="w", modelled=False, doc="resets the core; for debuggers")


class SCR(Word, addr=0xD10):
    """System control."""

    SEVONPEND = Bits(4, doc="an interrupt that becomes pending wakes WFE")
    SLEEPDEEP = Bits(2, doc="deep sleep")
    SLEEPONEXIT = Bits(1, doc="sleeps when the last handler returns")


class CCR(Word, addr=0xD14, reset=0x200):
    """Configuration and control."""

    STKALIGN = Bits(9, doc="frames are aligned to eight bytes")
    BFHFNMIGN = Bits(8, doc="bus faults are ignored at priority -1 and -2")
    DIV_0_TRP = Bits(4, doc="division by zero faults")
    UNALIGN_TRP = Bits(3, doc="unaligned accesses fault")
    USERSETMPEND = Bits(1, doc="unprivileged code can write STIR")
    NONBASETHRDENA = Bits(0, doc="Thread mode can be entered from any level")


class SHPR1(Word, addr=0xD18):
    """System handler priority, 4 to 6."""

    PRI_6 = Bits(23, 16, doc="UsageFault")
    PRI_5 = Bits(15, 8, doc="BusFault")
    PRI_4 = Bits(7, 0, doc="MemManage")


class SHPR2(Word, addr=0xD1C):
    """System handler priority, 11."""

    PRI_11 = Bits(31, 24, doc="SVCall")


class SHPR3(Word, addr=0xD20):
    """System handler priority, 12 to 15."""

    PRI_15 = Bits(31, 24, doc="SysTick")
    PRI_14 = Bits(23, 16, doc="PendSV")
    PRI_12 = Bits(7, 0, doc="DebugMonitor")


class SHCSR(Word, addr=0xD24):
    """System handler control and state."""

    USGFAULTENA = Bits(18, doc="UsageFault is enabled")
    BUSFAULTENA = Bits(17, doc="BusFault is enabled")
    MEMFAULTENA = Bits(16, doc="MemManage is enabled")
    SVCALLPENDED = Bits(15, doc="SVCall is pending")
    BUSFAULTPENDED = Bits(14, doc="BusFault is pending")
    MEMFAULTPENDED = Bits(13, doc="MemManage is pending")
    USGFAULTPENDED = Bits(12, doc="UsageFault is pending")
    SYSTICKACT = Bits(11, doc="SysTick is active")
    PENDSVACT = Bits(10, doc="PendSV is active")
    MONITORACT = Bits(8, doc="DebugMonitor is active")
    SVCALLACT = Bits(7, doc="SVCall is active")
    USGFAULTACT = Bits(3, doc="UsageFault is active")
    BUSFAULTACT = Bits(1, doc="BusFault is active")
    MEMFAULTACT = Bits(0, doc="MemManage is active")


class CFSR(Word, addr=0xD28, access="rc_w1"):
    """Configurable fault status."""

    DIVBYZERO = Bits(25, doc="division by zero")
    UNALIGNED = Bits(24, doc="unaligned access")
    NOCP = Bits(19, doc="coprocessor that is off")
    INVPC = Bits(18, doc="wrong EXC_RETURN")
    INVSTATE = Bits(17, doc="not Thumb")
    UNDEFINSTR = Bits(16, doc="undefined instruction")
    BFARVALID = Bits(15, doc="BFAR holds the address")
    LSPERR = Bits(13, modelled=False, doc="lazy saving of floating point")
    STKERR = Bits(12, doc="saving registers on exception entry")
    UNSTKERR = Bits(11, doc="restoring registers on exception return")
    IMPRECISERR = Bits(10, modelled=False, doc="a store was refused some instructions ago")
    PRECISERR = Bits(9, doc="load or store refused")
    IBUSERR = Bits(8, doc="instruction fetch refused")
    MMARVALID = Bits(7, doc="MMFAR holds the address")
    MLSPERR = Bits(5, modelled=False, doc="lazy saving of floating point, protected")
    MSTKERR = Bits(4, doc="saving registers, protected")
    MUNSTKERR = Bits(3, doc="restoring registers, protected")
    DACCVIOL = Bits(1, modelled=False, doc="load or store, protected")
    IACCVIOL = Bits(0, doc="instruction fetch, protected")


class HFSR(Word, addr=0xD2C, access="rc_w1"):
    """HardFault status."""

    DEBUGEVT = Bits(31, doc="BKPT without a debugger")
    FORCED = Bits(30, doc="another fault became a HardFault")
    VECTTBL = Bits(1, doc="reading the vector table")


class DFSR(Word, addr=0xD30, access="rc_w1"):
    """Debug fault status."""

    EXTERNAL = Bits(4, modelled=False, doc="external request")
    VCATCH = Bits(3, modelled=False, doc="vector catch")
    DWTTRAP = Bits(2, modelled=False, doc="watchpoint")
    BKPT = Bits(1, doc="BKPT")
    HALTED = Bits(0, modelled=False, doc="halt request")


class MMFAR(Word, addr=0xD34):
    """MemManage fault address."""


class BFAR(Word, addr=0xD38):
    """BusFault address."""


class AFSR(Word, addr=0xD3C, modelled=False):
    """Auxiliary fault status."""


class CPACR(Word, addr=0xD88):
    """Coprocessor access control."""

    CP11 = Bits(23, 22, doc="floating-point unit")
    CP10 = Bits(21, 20, doc="floating-point unit")


class DHCSR(Word, addr=0xDF0, modelled=False):
    """Debug halting control and status."""


class DCRSR(Word, addr=0xDF4, access="w", modelled=False):
    """Debug core register selector."""


class DCRDR(Word, addr=0xDF8, modelled=False):
    """Debug core register data."""


class DEMCR(Word, addr=0xDFC):
    """Debug exception and monitor control."""

    TRCENA = Bits(24, doc="DWT on")
    MON_REQ = Bits(19, modelled=False, doc="bit for use by the debug monitor")
    MON_STEP = Bits(18, modelled=False, doc="single step")
    MON_PEND = Bits(17, modelled=False, doc="DebugMonitor is pending")
    MON_EN = Bits(16, modelled=False, doc="DebugMonitor is enabled")
    VC_HARDERR = Bits(10, modelled=False, doc="vector catch: HardFault")
    VC_INTERR = Bits(9, modelled=False, doc="vector catch: exception entry")
    VC_BUSERR = Bits(8, modelled=False, doc="vector catch: BusFault")
    VC_STATERR = Bits(7, modelled=False, doc="vector catch: UsageFault, state")
    VC_CHKERR = Bits(6, modelled=False, doc="vector catch: UsageFault, checks")
    VC_NOCPERR = Bits(5, modelled=False, doc="vector catch: UsageFault, coprocessor")
    VC_MMERR = Bits(4, modelled=False, doc="vector catch: MemManage")
    VC_CORERESET = Bits(0, modelled=False, doc="vector catch: reset")


class FPCCR(Word, addr=0xF34, reset=0xC000_0000):
    """Floating-point context control."""

    ASPEN = Bits(31, doc="CONTROL.FPCA is set automatically")
    LSPEN = Bits(30, modelled=False, doc="lazy saving")
    MONRDY = Bits(8, access="r", modelled=False, doc="DebugMonitor could be pended")
    BFRDY = Bits(6, access="r", modelled=False, doc="BusFault could be pended")
    MMRDY = Bits(5, access="r", modelled=False, doc="MemManage could be pended")
    HFRDY = Bits(4, access="r", modelled=False, doc="HardFault could be pended")
    THREAD = Bits(3, access="r", modelled=False, doc="saved from Thread mode")
    USER = Bits(1, access="r", modelled=False, doc="saved from unprivileged code")
    LSPACT = Bits(0, access="r", modelled=False, doc="lazy saving is due")


class FPCAR(Word, addr=0xF38):
    """Floating-point context address."""

    ADDRESS = Bits(31, 3, doc="address of the reserved part of the frame")


class FPDSCR(Word, addr=0xF3C, modelled=False):
    """Floating-point default status control."""

    AHP = Bits(26, doc="alternative half precision")
    DN = Bits(25, doc="default NaN")
    FZ = Bits(24, doc="flush to zero")
    RMode = Bits(23, 22, doc="rounding mode")


class MVFR0(Word, addr=0xF40, access="r", reset=0x1011_0021):
    """Media and floating-point features 0."""


class MVFR1(Word, addr=0xF44, access="r", reset=0x1100_0011):
    """Media and floating-point features 1."""
