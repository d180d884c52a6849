"""Endless programs whose iterations have the highest cost for the emulator, one for each kind of access.

Each program runs at 84 MHz with clocks for all peripherals, unless stated otherwise. The name describes the loop;
``source`` is for :func:`tests.support.arm.hostile_programs.program`.
"""

from __future__ import annotations

from random import Random

from fcu_emulator.emulator.chip.memory_map import ADDRESSES
from tests.support.arm.hostile_programs import EVERY_CLOCK_AND_INTERRUPT, LOOK_AWAY, program

RCC = 0x4002_3800
CR, PLLCFGR, CFGR, CIR, APB1RSTR, APB2RSTR = (RCC + n for n in (0, 4, 8, 12, 0x20, 0x24))
AHB1ENR, APB1ENR, APB2ENR, BDCR, CSR = (RCC + n for n in (0x30, 0x40, 0x44, 0x70, 0x74))
CLOCKED = EVERY_CLOCK_AND_INTERRUPT.split("mov32 r0, 0xE000E100")[0]
"""Clocks for all peripherals, without interrupts."""


def put(address: int, value: int) -> str:
    """Return the instructions that store a word."""
    return f"mov32 r0, {address}\nmov32 r1, {value}\nstr r1, [r0]\n"


PLL_84_MHZ = (
    put(PLLCFGR, 7 << 24 | 1 << 16 | 336 << 6 | 16)
    + put(CR, 0x0100_0081)
    + "ready: ldr r1, [r0]\nmov32 r2, 0x02000000\nands r1, r2\nbeq ready\n"
    + put(CFGR, 4 << 10 | 2)
)


def endless(loop: str, before: str = "", handlers: str = LOOK_AWAY, clocks: str = CLOCKED) -> bytes:
    """Return a program that sets up clocks, does ``before`` and then repeats ``loop``."""
    source = f"reset:\n{PLL_84_MHZ}{clocks}\n{before}\nagain:\n{loop}\nb again\n{handlers}"
    return program(source)


def two_values(address: int, one: int, other: int) -> bytes:
    """Return the instructions that write two values to a register in turn."""
    before = f"mov32 r0, {address}\nmov32 r1, {one}\nmov32 r2, {other}"
    return endless("str r1, [r0]\nstr r2, [r0]", before)


def reads(address: int, access: str = "ldr r1, [r0]") -> bytes:
    """Return instructions that read a register. The count in R3 changes, so that no pass can be skipped."""
    return endless(f"{access}\nadds r3, #1", f"mov32 r0, {address}\nmovs r3, #0")


def _base(name: str) -> int:
    return ADDRESSES[name][0]


def _output(port: str = "GPIOC") -> str:
    return put(_base(port), 0x5555_5555)


def _timer(name: str, arr: int, more: str = "") -> str:
    base = _base(name)
    return put(base + 0x2C, arr) + more + put(base, 1)


def _i2c(name: str = "I2C2") -> str:
    """Return the set-up of I2C2 on PB10 and PB3, as fast as CCR allows."""
    base, gpiob = _base(name), _base("GPIOB")
    return (
        put(gpiob + 4, 1 << 10 | 1 << 3)
        + put(gpiob + 32, 9 << 12)
        + put(gpiob + 36, 4 << 8)
        + put(gpiob, 2 << 20 | 2 << 6)
        + put(base + 4, 42)
        + put(base + 28, 1 << 15 | 1)
        + put(base + 32, 2)
        + put(base, 1)
    )


_NO_WAIT = "mov32 r7, 0\n"
GPIOB, SPI2, I2C2, USART1 = (_base(name) for name in ("GPIOB", "SPI2", "I2C2", "USART1"))
_MULTIPLE_FAULTS = """
fault:
    mrs r0, msp
    ldr r1, [r0, #24]
    adds r1, #4
    str r1, [r0, #24]
    bx lr
interrupt: bx lr
"""


def clock_programs() -> dict[str, bytes]:
    """Return programs that change RCC."""
    pll = 4 << 10 | 2
    hse = endless(
        "str r1, [r0]\nstr r2, [r0]",
        put(CR, 0x0101_0081)
        + "wait: ldr r1, [r0]\nmov32 r2, 0x00020000\nands r1, r2\nbeq wait\n"
        + f"mov32 r0, {CFGR}\nmov32 r1, 0\nmov32 r2, 1\n",
    )
    return {
        "RCC: HPRE flips": two_values(CFGR, pll, pll | 8 << 4),
        "RCC: PPRE1 and PPRE2 flip": two_values(CFGR, pll, pll | 6 << 10 | 6 << 13),
        "RCC: SW flips between HSI and PLL": two_values(CFGR, pll, 4 << 10),
        "RCC: SW flips between HSI and HSE": hse,
        "RCC: MCO, no frequency changes": two_values(CFGR, pll, pll | 3 << 21),
        "RCC: AHB1ENR flips": two_values(AHB1ENR, 0, 0xFFFF_FFFF),
        "RCC: APB1ENR flips": two_values(APB1ENR, 0, 0xFFFF_FFFF),
        "RCC: APB2ENR flips": two_values(APB2ENR, 0, 0xFFFF_FFFF),
        "RCC: APB1RSTR flips": two_values(APB1RSTR, 0, 0xFFFF_FFFF),
        "RCC: APB2RSTR flips": two_values(APB2RSTR, 0, 0xFFFF_FFFF),
        "RCC: AHB1RSTR flips": two_values(RCC + 0x10, 0, 0xFFFF_FFFF),
        "RCC: PLL goes off and on": endless(
            "str r1, [r0]\nstr r2, [r0]",
            put(CFGR, 0) + f"mov32 r0, {CR}\nmov32 r1, 0x81\nmov32 r2, 0x01000081",
        ),
        "RCC: HSE goes off and on": endless(
            "str r1, [r0]\nstr r2, [r0]", f"mov32 r0, {CR}\nmov32 r1, 0x01000081\nmov32 r2, 0x01010081"
        ),
        "RCC: LSI goes off and on": two_values(CSR, 0, 1),
        "RCC: CIR": two_values(CIR, 0, 0x00FF_1F00),
        "RCC: CR is read": reads(CR),
        "RCC: APB1ENR gets the same": two_values(APB1ENR, 0xFFFF_FFFF, 0xFFFF_FFFF),
        "RCC: BDCR resets the backup domain": endless(
            "str r1, [r0]\nstr r2, [r0]",
            put(_base("PWR"), 0x100) + f"mov32 r0, {BDCR}\nmov32 r1, 0x10000\nmov32 r2, 0",
        ),
    }


def address_programs() -> dict[str, bytes]:
    """Return programs that access addresses without a device, and peripherals that are not modelled."""
    everywhere = """
    ldr r1, [r0]
    adds r0, r0, r4
    """
    return {
        "unmapped: a reserved register is read": reads(_base("USART1") + 0x3F0),
        "unmapped: a reserved register is written": two_values(_base("USART1") + 0x3F0, 1, 2),
        "unmapped: a reserved block is read": reads(0x4000_1000),
        "unmapped: a reserved block is written": two_values(0x4000_1000, 1, 2),
        "unmapped: SDIO is read": reads(_base("SDIO")),
        "unmapped: SPI4 is written": two_values(_base("SPI4"), 1, 2),
        "unmapped: private space is read": reads(0xE004_1000),
        "unmapped: another word each time": endless(everywhere, "mov32 r0, 0x40000000\nmov32 r4, 4"),
        "unmapped: a block without clock is read": endless(
            "ldr r1, [r0]\nadds r3, #1", put(APB1ENR, 0) + f"mov32 r0, {SPI2}"
        ),
        "unmapped: a block without clock is written": endless(
            "str r1, [r0]\nstr r2, [r0]", put(APB1ENR, 0) + f"mov32 r0, {SPI2}"
        ),
        "unmapped: bus fault": reads(0x6000_0000),
        "unmapped: BusFault in its handler": endless(
            "ldr r1, [r0]\nadds r3, #1", put(0xE000_ED24, 7 << 16) + "mov32 r0, 0x60000000"
        ),
        "unmapped: fetch fault": endless(
            "ldr r0, [r5]\nblx r0",
            "mov32 r5, 0x20000100\nmov32 r0, 0x10000001\nstr r0, [r5]",
            "fault:\nmrs r0, msp\nldr r1, [r0, #20]\nstr r1, [r0, #24]\nbx lr\ninterrupt: bx lr",
        ),
        "unmapped: undefined instruction": endless("udf #0\nnop"),
        "unmapped: bit-band of a reserved block": two_values(0x4200_0000 + 0x1000 * 32, 0, 1),
        "bit-band: RCC": two_values(0x4200_0000 + (CFGR - 0x4000_0000) * 32 + 4 * 7, 0, 1),
        "bit-band: GPIO output": endless(
            "str r1, [r0]\nstr r2, [r0]",
            _output() + f"mov32 r0, {0x4200_0000 + (_base('GPIOC') + 20 - 0x4000_0000) * 32}\n"
            "movs r1, #0\nmovs r2, #1",
        ),
        "bit-band: RAM": two_values(0x2200_0400, 0, 1),
        "unaligned register": reads(_base("GPIOA") + 1),
    }


def pin_programs() -> dict[str, bytes]:
    """Return programs for GPIO, EXTI and SYSCFG."""
    gpioc = _base("GPIOC")
    exti, syscfg = _base("EXTI"), _base("SYSCFG")
    enabled = put(exti, 0xFFFF) + put(exti + 8, 0xFFFF) + put(exti + 12, 0xFFFF)

    def flip(port: str, offset: int, one: int, other: int, before: str = "") -> bytes:
        place = f"mov32 r0, {_base(port) + offset}\nmov32 r1, {one}\nmov32 r2, {other}"
        return endless("str r1, [r0]\nstr r2, [r0]", _output(port) + before + place)

    return {
        "GPIO: one output toggles by ODR": flip("GPIOC", 20, 0, 1),
        "GPIO: one output toggles by BSRR": flip("GPIOC", 24, 1, 1 << 16),
        "GPIO: sixteen outputs toggle": flip("GPIOC", 20, 0, 0xFFFF),
        "GPIO: sixteen pins of port B toggle": flip("GPIOB", 20, 0, 0xFFFF),
        "GPIO: ODR gets the same": flip("GPIOC", 20, 1, 1),
        "GPIO: inputs get other ODR": two_values(gpioc + 20, 0, 0xFFFF),
        "GPIO: MODER of sixteen pins": flip("GPIOC", 0, 0, 0x5555_5555),
        "GPIO: PUPDR of sixteen pins": two_values(gpioc + 12, 0, 0x5555_5555),
        "GPIO: AFRL": two_values(GPIOB + 32, 0, 0x5555_5555),
        "GPIO: IDR is read": reads(gpioc + 16),
        "EXTI: SWIER without interrupt": two_values(exti + 16, 0, 1),
        "EXTI: software interrupt storm": endless(
            "str r1, [r0]\nstr r2, [r0]",
            put(exti, 1) + put(0xE000_E100, 1 << 6) + f"mov32 r0, {exti + 16}\nmovs r1, #0\nmovs r2, #1",
            f"fault: b .\ninterrupt: mov32 r3, {exti + 20}\nmovs r4, #1\nstr r4, [r3]\nbx lr",
        ),
        "EXTI: edges of sixteen pins": flip("GPIOC", 20, 0, 0xFFFF, enabled),
        "SYSCFG: EXTICR1": two_values(syscfg + 8, 0, 0x2222),
    }


def block_programs() -> dict[str, bytes]:
    """Return programs for the peripherals in Python: polled, written, and working as fast as possible."""
    programs = {}
    for name in (
        "PWR",
        "FLASH",
        "ADC1",
        "CRC",
        "RTC",
        "IWDG",
        "WWDG",
        "DBGMCU",
        "DMA1",
        "TIM2",
        "SPI1",
        "I2C1",
    ):
        programs[f"{name}: read"] = reads(_base(name))
        programs[f"{name}: written"] = two_values(_base(name), 0, 0x10)
    adc = _base("ADC1")
    rtc = put(_base("PWR"), 0x100) + put(CSR, 1) + put(BDCR, 0x8200)
    rtc += put(_base("RTC") + 0x24, 0xCA) + put(_base("RTC") + 0x24, 0x53)
    programs["ADC1: converts all the time"] = endless(
        "adds r3, #1", put(adc + 8, 3) + put(adc + 8, 0x4000_0003)
    )
    programs["ADC1: SWSTART each time"] = endless(
        "str r1, [r0]", put(adc + 8, 1) + f"mov32 r0, {adc + 8}\nmov32 r1, 0x40000001"
    )
    dma = _base("DMA2")
    results = put(dma + 0x14, 64) + put(dma + 0x18, adc + 0x4C) + put(dma + 0x1C, 0x2000_1000)
    results += put(dma + 0x10, 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8 | 1)
    programs["ADC1: converts into DMA all the time"] = endless(
        "adds r3, #1",
        results + put(adc + 4, 3 << 24) + put(adc + 8, 0x0303) + put(adc + 8, 0x4000_0303),
    )
    programs["ADC1: triggered by the shortest period"] = endless(
        "adds r3, #1",
        put(_base("TIM2") + 4, 2 << 4) + _timer("TIM2", 1) + results + put(adc + 8, 0x1600_0301),
    )
    programs["CRC: DR"] = two_values(_base("CRC"), 1, 2)
    programs["RTC: SSR is read"] = endless(
        "ldr r1, [r0]\nadds r3, #1", rtc + f"mov32 r0, {_base('RTC') + 0x28}"
    )
    programs["RTC: wake-up timer"] = endless(
        "adds r3, #1", rtc + put(_base("RTC") + 0x14, 0) + put(_base("RTC") + 8, 0x4400 | 3)
    )
    programs["IWDG: reloads"] = endless(
        "str r1, [r0]\nstr r2, [r0]",
        put(_base("IWDG"), 0xCCCC) + f"mov32 r0, {_base('IWDG')}\nmov32 r1, 0xAAAA\nmov32 r2, 0xAAAA",
    )
    programs["FLASH: ACR"] = two_values(_base("FLASH"), 0x700, 0x702)
    programs["FLASH: KEYR"] = two_values(_base("FLASH") + 4, 0x4567_0123, 0xCDEF_89AB)
    programs["WWDG: counter"] = two_values(_base("WWDG"), 0xFF, 0xFE)
    return programs


def interrupt_programs() -> dict[str, bytes]:
    """Return programs for exceptions, timers and the core's own registers."""
    return {
        "TIM2: ARR flips": endless(
            "str r1, [r0]\nstr r2, [r0]",
            _timer("TIM2", 100) + f"mov32 r0, {0x4000_002C}\nmovs r1, #99\nmovs r2, #7",
        ),
        "TIM2: CNT flips": endless(
            "str r1, [r0]\nstr r2, [r0]",
            _timer("TIM2", 100) + f"mov32 r0, {0x4000_0024}\nmovs r1, #99\nmovs r2, #7",
        ),
        "TIM2: PSC and UG": endless(
            "str r1, [r0]\nstr r2, [r0]\nstr r3, [r4]",
            _timer("TIM2", 100)
            + "mov32 r0, 0x40000028\nmovs r1, #9\nmovs r2, #7\nmovs r3, #1\nmov32 r4, 0x40000014",
        ),
        "TIM2: CNT is read": endless(
            "ldr r1, [r0]\nadds r3, #1", _timer("TIM2", 99) + "mov32 r0, 0x40000024"
        ),
        "timers: eight with the shortest period": endless(
            "adds r3, #1",
            "".join(_timer(f"TIM{n}", 1, put(_base(f"TIM{n}") + 12, 1)) for n in (1, 2, 3, 4, 5, 9, 10, 11)),
        ),
        "timers: interrupt storm": endless(
            "adds r3, #1",
            put(0xE000_E100, 1 << 28) + _timer("TIM2", 1, put(0x4000_000C, 1)),
            "fault: b .\ninterrupt: mov32 r0, 0x40000010\nmovs r1, #0\nstr r1, [r0]\nbx lr",
        ),
        "timers: channels in PWM": endless(
            "str r1, [r0]\nstr r2, [r0]",
            put(_base("TIM4") + 0x18, 0x6868)
            + put(_base("TIM4") + 0x20, 0x3333)
            + put(_base("TIM4") + 0x0C, 0x1E)
            + _timer("TIM4", 3)
            + f"mov32 r0, {_base('TIM4') + 0x34}\nmovs r1, #1\nmovs r2, #2",
        ),
        "SysTick: reload 1": endless(
            "adds r3, #1", put(0xE000_E014, 1) + put(0xE000_E010, 7), "fault: b .\ninterrupt: bx lr"
        ),
        "SysTick: reload changes": endless(
            "str r1, [r0]\nstr r2, [r0]",
            put(0xE000_E010, 5) + "mov32 r0, 0xE000E014\nmovs r1, #9\nmovs r2, #99",
        ),
        "SysTick: VAL is read": endless(
            "ldr r1, [r0]\nadds r3, #1", put(0xE000_E014, 99) + put(0xE000_E010, 5) + "mov32 r0, 0xE000E018"
        ),
        "SVC storm": endless("svc #0"),
        "PendSV storm": endless("str r1, [r0]", "mov32 r0, 0xE000ED04\nmov32 r1, 0x10000000"),
        "NVIC: ISER and ICER": endless(
            "str r1, [r0]\nstr r1, [r2]", "mov32 r0, 0xE000E100\nmov32 r2, 0xE000E180\nmov32 r1, 0x40"
        ),
        "NVIC: ISPR storm": endless(
            "str r1, [r0]", put(0xE000_E100, 0x40) + "mov32 r0, 0xE000E200\nmov32 r1, 0x40", LOOK_AWAY
        ),
        "NVIC: priorities": two_values(0xE000_E400, 0x1020_3040, 0x4030_2010),
        "SCB: VTOR": two_values(0xE000_ED08, 0x0800_0000, 0x0800_0000),
        "SCB: CPACR flips": two_values(0xE000_ED88, 0, 0xF << 20),
        "SCB: CCR.UNALIGN_TRP flips": two_values(0xE000_ED14, 0x200, 0x208),
        "MPU: RBAR": two_values(0xE000_ED9C, 0x2000_0010, 0x2000_0011),
        "DWT: CYCCNT is read": endless(
            "ldr r1, [r0]\nadds r3, #1",
            put(0xE000_EDFC, 1 << 24) + put(0xE000_1000, 1) + "mov32 r0, 0xE0001004",
        ),
        "WFE and SEV": endless("sev\nwfe"),
        "PRIMASK flips": endless("cpsid i\ncpsie i"),
    }


def code_programs() -> dict[str, bytes]:
    """Return programs whose code changes, or is in all places."""
    rewrites = """
    str r1, [r0]
    blx r2
    str r3, [r0]
    blx r2
    """
    setup = "mov32 r0, 0x20000000\nmov32 r1, 0x47702601\nmov32 r3, 0x47702602\nmov32 r2, 0x20000001"
    writes_beside = f"{setup}\nstr r1, [r0]\nblx r2\nmov32 r4, 0x20000800"
    jumps = "".join(f"b j{n + 1}\nj{n + 1}:\n" for n in range(400))
    return {
        "code in RAM rewrites itself": endless(f"{rewrites}adds r5, #1", setup),
        "code in RAM, data written beside": endless("str r1, [r4]\nstr r3, [r4]\nblx r2", writes_beside),
        "code in RAM moves through RAM": endless(
            "str r1, [r0]\nmov r2, r0\nadds r2, #1\nblx r2\nadds r0, #4\nands r0, r5\norrs r0, r6",
            setup.replace(
                "mov32 r2, 0x20000001", "mov32 r5, 0x2000FFFC\nmov32 r6, 0x20000000\nmov32 r1, 0x47700000"
            ),
        ),
        "jumps": endless(f"b j0\nj0:\n{jumps}"),
        "arithmetic": endless("adds r1, #1\nadds r2, r2, r1\neors r3, r2\n" * 20),
        "stores to RAM": endless("str r1, [r0]\nadds r1, #1\n" * 20, "mov32 r0, 0x20000000"),
        "divisions": endless("udiv r1, r2, r3\n" * 20, "movs r2, #77\nmovs r3, #3"),
    }


def wire_programs() -> dict[str, bytes]:
    """Return programs for I2C, SPI, UART and DMA."""
    fast_spi = put(GPIOB, 0xA900_0000 | 1 << 24) + put(GPIOB + 36, 0x5550_0000) + put(SPI2, 0x0344)
    uart = (
        put(0x4002_0000, 0xA808_0000 | 2 << 20)
        + put(0x4002_0024, 0x770)
        + put(USART1 + 8, 16)
        + put(USART1 + 12, 0x200C)
    )
    dma2 = _base("DMA2")
    m2m = (
        put(dma2 + 0x10 + 4, 0xFFFF) + put(dma2 + 0x10 + 8, 0x2000_0000) + put(dma2 + 0x10 + 12, 0x2000_8000)
    )
    sensor = "".join(
        f"w{n}: ldr r3, [r0, #20]\nmovs r4, #{bit}\nands r3, r4\nbeq w{n}\n{then}\n"
        for n, (bit, then) in enumerate(
            (
                (1, "movs r3, #0x3C\nstr r3, [r0, #16]"),
                (2, "ldr r3, [r0, #24]\nmovs r3, #0x60\nstr r3, [r0, #16]"),
                (4, "movs r3, #0x20\nstr r3, [r0, #16]"),
                (4, "mov32 r3, 0x201\nstr r3, [r0]"),
            )
        )
    )
    return {
        "I2C: START and STOP": endless(
            "str r1, [r0]\nstr r2, [r0]", _i2c() + f"mov32 r0, {I2C2}\nmov32 r1, 0x101\nmov32 r2, 0x201"
        ),
        "I2C: START": endless("str r1, [r0]", _i2c() + f"mov32 r0, {I2C2}\nmov32 r1, 0x101"),
        "I2C: SWRST flips": endless(
            "str r1, [r0]\nstr r2, [r0]", _i2c() + f"mov32 r0, {I2C2}\nmov32 r1, 0x8000\nmov32 r2, 0x101"
        ),
        "I2C: PE flips": endless(
            "str r1, [r0]\nstr r2, [r0]", _i2c() + f"mov32 r0, {I2C2}\nmovs r1, #0\nmovs r2, #1"
        ),
        "I2C: CCR flips": endless(
            "str r1, [r0]\nstr r2, [r0]",
            _i2c() + f"mov32 r0, {I2C2 + 28}\nmov32 r1, 0x800E\nmov32 r2, 0x8020",
        ),
        "I2C: SR1 and SR2 are read": endless(
            "ldr r1, [r0]\nldr r2, [r0, #4]\nadds r3, #1", _i2c() + f"mov32 r0, {I2C2 + 20}"
        ),
        "I2C: LIS2MDL is reset by software": endless(
            f"mov32 r1, 0x101\nstr r1, [r0]\n{sensor}", _i2c() + f"mov32 r0, {I2C2}"
        ),
        "SPI: DR at the highest rate": endless(
            "str r1, [r0]", fast_spi + f"mov32 r0, {SPI2 + 12}\nmovs r1, #0x55"
        ),
        "SPI: messages of one byte": endless(
            "str r3, [r4]\nstr r1, [r0]\n" + "nop\n" * 14 + "str r5, [r4]",
            fast_spi
            + f"mov32 r0, {SPI2 + 12}\nmovs r1, #0x8F\nmov32 r4, {GPIOB + 24}\n"
            + f"mov32 r3, {1 << 28}\nmov32 r5, {1 << 12}",
        ),
        "SPI: SPE flips": endless(
            "str r1, [r0]\nstr r2, [r0]", fast_spi + f"mov32 r0, {SPI2}\nmov32 r1, 0x304\nmov32 r2, 0x344"
        ),
        "UART: highest rate": endless("str r1, [r0]", uart + f"mov32 r0, {USART1 + 4}\nmovs r1, #0x55"),
        "UART: break": endless("str r1, [r0]", uart + f"mov32 r0, {USART1 + 12}\nmov32 r1, 0x200D"),
        "UART: BRR flips": endless(
            "str r1, [r0]\nstr r2, [r0]\nstr r3, [r4]",
            uart + f"mov32 r0, {USART1 + 8}\nmovs r1, #16\nmovs r2, #17\nmov32 r4, {USART1 + 4}",
        ),
        "UART: TE and UE flip": endless(
            "str r1, [r0]\nstr r2, [r0]", uart + f"mov32 r0, {USART1 + 12}\nmov32 r1, 0\nmov32 r2, 0x200C"
        ),
        "DMA: memory to memory": endless(
            "str r1, [r0]\nstr r2, [r0]\nstr r3, [r0]",
            m2m + f"mov32 r0, {dma2 + 16}\nmov32 r1, 0\nmov32 r2, 0x681\nmov32 r3, 0x681",
        ),
        "DMA: circular, by a timer, to RCC": endless(
            "adds r3, #1",
            put(_base("DMA1") + 0x10 + 0x18 + 4, 8)
            + put(_base("DMA1") + 0x10 + 0x18 + 8, CFGR)
            + put(_base("DMA1") + 0x10 + 0x18 + 12, 0x2000_0000)
            + put(_base("DMA1") + 0x10 + 0x18, 3 << 25 | 2 << 13 | 2 << 11 | 1 << 10 | 1 << 8 | 1 << 6 | 1)
            + _timer("TIM2", 1, put(0x4000_000C, 1 << 8)),
        ),
    }


def reset_programs() -> dict[str, bytes]:
    """Return programs that cause resets."""
    iwdg = _base("IWDG")
    return {
        "reset: AIRCR": program("reset:\n" + put(0xE000_ED0C, 0x05FA_0004) + "b ."),
        "reset: watchdog": program(
            "reset:\n" + put(iwdg, 0x5555) + put(iwdg + 4, 0) + put(iwdg + 8, 0) + put(iwdg, 0xCCCC) + "b ."
        ),
    }


def mixtures(count: int) -> dict[str, bytes]:
    """Return loops of thirty random loads and stores to registers of all peripherals, with fixed seeds."""
    programs = {}
    for seed in range(count):
        random = Random(seed)
        places = list(ADDRESSES.values())
        loop = ""
        for _ in range(30):
            base, size = random.choice(places)
            address = base + 4 * random.randrange(min(size, 0x80) // 4)
            value = random.choice((0, 1, 0xFFFF_FFFF, random.getrandbits(32), 1 << random.randrange(32)))
            loop += f"mov32 r0, {address}\n"
            loop += "ldr r1, [r0]\n" if random.random() < 0.4 else f"mov32 r1, {value}\nstr r1, [r0]\n"
        programs[f"mixture {seed}"] = endless(loop, clocks=EVERY_CLOCK_AND_INTERRUPT)
    return programs


def all_programs() -> dict[str, bytes]:
    """Return all programs by name."""
    return {
        **clock_programs(),
        **address_programs(),
        **pin_programs(),
        **block_programs(),
        **interrupt_programs(),
        **code_programs(),
        **wire_programs(),
        **reset_programs(),
        **mixtures(20),
    }
