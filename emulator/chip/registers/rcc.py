"""Reset and clock control (RM0368 section 6.3)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 6.3"
INSTANCES = ("RCC",)


class CR(Word, addr=0x00, reset=0x83):
    """Clock control."""

    PLLI2SRDY = Bits(27, access="r", doc="the I2S PLL is locked")
    PLLI2SON = Bits(26, doc="I2S PLL on")
    PLLRDY = Bits(25, access="r", doc="the PLL is locked")
    PLLON = Bits(24, doc="PLL on")
    CSSON = Bits(19, modelled=False, doc="clock security system")
    HSEBYP = Bits(18, modelled=False, doc="HSE is a clock, not a crystal")
    HSERDY = Bits(17, access="r", doc="HSE is stable")
    HSEON = Bits(16, doc="HSE on")
    HSICAL = Bits(15, 8, access="r", doc="HSI calibration")
    HSITRIM = Bits(7, 3, modelled=False, doc="HSI trimming")
    HSIRDY = Bits(1, access="r", doc="HSI is stable")
    HSION = Bits(0, doc="HSI on")


class PLLCFGR(Word, addr=0x04, reset=0x2400_3010):
    """PLL configuration."""

    BIT29 = Bits(29, modelled=False, doc="unnamed bit; 1 after reset, then as written")
    PLLQ = Bits(27, 24, doc="divider for USB and SDIO")
    PLLSRC = Bits(22, doc="PLL input is HSE instead of HSI")
    PLLP = Bits(17, 16, doc="divider for SYSCLK: 2, 4, 6, 8")
    PLLN = Bits(14, 6, doc="multiplication factor")
    PLLM = Bits(5, 0, doc="divider of the input")


class CFGR(Word, addr=0x08):
    """Clock configuration."""

    MCO2 = Bits(31, 30, modelled=False, doc="clock output 2")
    MCO2PRE = Bits(29, 27, modelled=False, doc="prescaler of clock output 2")
    MCO1PRE = Bits(26, 24, modelled=False, doc="prescaler of clock output 1")
    I2SSRC = Bits(23, modelled=False, doc="I2S clock from a pin")
    MCO1 = Bits(22, 21, modelled=False, doc="clock output 1")
    RTCPRE = Bits(20, 16, doc="HSE divider for the RTC")
    PPRE2 = Bits(15, 13, doc="APB2 prescaler")
    PPRE1 = Bits(12, 10, doc="APB1 prescaler")
    HPRE = Bits(7, 4, doc="AHB prescaler")
    SWS = Bits(3, 2, access="r", doc="current SYSCLK: HSI, HSE, PLL")
    SW = Bits(1, 0, doc="requested SYSCLK: HSI, HSE, PLL")


class CIR(Word, addr=0x0C):
    """Clock interrupts."""

    CSSC = Bits(23, access="w", doc="clears CSSF")
    PLLI2SRDYC = Bits(21, access="w", doc="clears PLLI2SRDYF")
    PLLRDYC = Bits(20, access="w", doc="clears PLLRDYF")
    HSERDYC = Bits(19, access="w", doc="clears HSERDYF")
    HSIRDYC = Bits(18, access="w", doc="clears HSIRDYF")
    LSERDYC = Bits(17, access="w", doc="clears LSERDYF")
    LSIRDYC = Bits(16, access="w", doc="clears LSIRDYF")
    PLLI2SRDYIE = Bits(13, doc="interrupt on PLLI2SRDYF")
    PLLRDYIE = Bits(12, doc="interrupt on PLLRDYF")
    HSERDYIE = Bits(11, doc="interrupt on HSERDYF")
    HSIRDYIE = Bits(10, doc="interrupt on HSIRDYF")
    LSERDYIE = Bits(9, doc="interrupt on LSERDYF")
    LSIRDYIE = Bits(8, doc="interrupt on LSIRDYF")
    CSSF = Bits(7, access="r", modelled=False, doc="the clock security system has detected a failure of HSE")
    PLLI2SRDYF = Bits(5, access="r", doc="the I2S PLL has become ready")
    PLLRDYF = Bits(4, access="r", doc="the PLL has become ready")
    HSERDYF = Bits(3, access="r", doc="HSE has become ready")
    HSIRDYF = Bits(2, access="r", doc="HSI has become ready")
    LSERDYF = Bits(1, access="r", doc="LSE has become ready")
    LSIRDYF = Bits(0, access="r", doc="LSI has become ready")


class AHB1RSTR(Word, addr=0x10):
    """Resets of peripherals on AHB1."""

    DMA2RST = Bits(22, doc="DMA2")
    DMA1RST = Bits(21, doc="DMA1")
    CRCRST = Bits(12, doc="CRC")
    GPIOHRST = Bits(7, doc="GPIOH")
    GPIOERST = Bits(4, doc="GPIOE")
    GPIODRST = Bits(3, doc="GPIOD")
    GPIOCRST = Bits(2, doc="GPIOC")
    GPIOBRST = Bits(1, doc="GPIOB")
    GPIOARST = Bits(0, doc="GPIOA")


class AHB2RSTR(Word, addr=0x14):
    """Resets of peripherals on AHB2."""

    OTGFSRST = Bits(7, modelled=False, doc="OTG_FS")


class APB1RSTR(Word, addr=0x20):
    """Resets of peripherals on APB1."""

    PWRRST = Bits(28, doc="PWR")
    I2C3RST = Bits(23, doc="I2C3")
    I2C2RST = Bits(22, doc="I2C2")
    I2C1RST = Bits(21, doc="I2C1")
    USART2RST = Bits(17, doc="USART2")
    SPI3RST = Bits(15, doc="SPI3")
    SPI2RST = Bits(14, doc="SPI2")
    WWDGRST = Bits(11, doc="WWDG")
    TIM5RST = Bits(3, doc="TIM5")
    TIM4RST = Bits(2, doc="TIM4")
    TIM3RST = Bits(1, doc="TIM3")
    TIM2RST = Bits(0, doc="TIM2")


class APB2RSTR(Word, addr=0x24):
    """Resets of peripherals on APB2."""

    TIM11RST = Bits(18, doc="TIM11")
    TIM10RST = Bits(17, doc="TIM10")
    TIM9RST = Bits(16, doc="TIM9")
    SYSCFGRST = Bits(14, doc="SYSCFG")
    SPI4RST = Bits(13, modelled=False, doc="SPI4")
    SPI1RST = Bits(12, doc="SPI1")
    SDIORST = Bits(11, modelled=False, doc="SDIO")
    ADCRST = Bits(8, doc="ADC1")
    USART6RST = Bits(5, doc="USART6")
    USART1RST = Bits(4, doc="USART1")
    TIM1RST = Bits(0, doc="TIM1")


class AHB1ENR(Word, addr=0x30):
    """Clocks of peripherals on AHB1."""

    DMA2EN = Bits(22, doc="DMA2")
    DMA1EN = Bits(21, doc="DMA1")
    CRCEN = Bits(12, doc="CRC")
    GPIOHEN = Bits(7, doc="GPIOH")
    GPIOEEN = Bits(4, doc="GPIOE")
    GPIODEN = Bits(3, doc="GPIOD")
    GPIOCEN = Bits(2, doc="GPIOC")
    GPIOBEN = Bits(1, doc="GPIOB")
    GPIOAEN = Bits(0, doc="GPIOA")


class AHB2ENR(Word, addr=0x34):
    """Clocks of peripherals on AHB2."""

    OTGFSEN = Bits(7, modelled=False, doc="OTG_FS")


class APB1ENR(Word, addr=0x40):
    """Clocks of peripherals on APB1."""

    PWREN = Bits(28, doc="PWR")
    I2C3EN = Bits(23, doc="I2C3")
    I2C2EN = Bits(22, doc="I2C2")
    I2C1EN = Bits(21, doc="I2C1")
    USART2EN = Bits(17, doc="USART2")
    SPI3EN = Bits(15, doc="SPI3")
    SPI2EN = Bits(14, doc="SPI2")
    WWDGEN = Bits(11, doc="WWDG")
    TIM5EN = Bits(3, doc="TIM5")
    TIM4EN = Bits(2, doc="TIM4")
    TIM3EN = Bits(1, doc="TIM3")
    TIM2EN = Bits(0, doc="TIM2")


class APB2ENR(Word, addr=0x44):
    """Clocks of peripherals on APB2."""

    TIM11EN = Bits(18, doc="TIM11")
    TIM10EN = Bits(17, doc="TIM10")
    TIM9EN = Bits(16, doc="TIM9")
    SYSCFGEN = Bits(14, doc="SYSCFG")
    SPI4EN = Bits(13, modelled=False, doc="SPI4")
    SPI1EN = Bits(12, doc="SPI1")
    SDIOEN = Bits(11, modelled=False, doc="SDIO")
    ADC1EN = Bits(8, doc="ADC1")
    USART6EN = Bits(5, doc="USART6")
    USART1EN = Bits(4, doc="USART1")
    TIM1EN = Bits(0, doc="TIM1")


class AHB1LPENR(Word, addr=0x50, reset=0x0061_900F, modelled=False):
    """Clocks of peripherals on AHB1 in sleep mode."""

    SRAM1LPEN = Bits(16, doc="SRAM")
    FLITFLPEN = Bits(15, doc="flash interface")
    DMA2LPEN = Bits(22, doc="DMA2")
    DMA1LPEN = Bits(21, doc="DMA1")
    CRCLPEN = Bits(12, doc="CRC")
    GPIOHLPEN = Bits(7, doc="GPIOH")
    GPIOELPEN = Bits(4, doc="GPIOE")
    GPIODLPEN = Bits(3, doc="GPIOD")
    GPIOCLPEN = Bits(2, doc="GPIOC")
    GPIOBLPEN = Bits(1, doc="GPIOB")
    GPIOALPEN = Bits(0, doc="GPIOA")


class AHB2LPENR(Word, addr=0x54, reset=0x80, modelled=False):
    """Clocks of peripherals on AHB2 in sleep mode."""

    OTGFSLPEN = Bits(7, doc="OTG_FS")


class APB1LPENR(Word, addr=0x60, reset=0x10E2_C80F, modelled=False):
    """Clocks of peripherals on APB1 in sleep mode."""

    PWRLPEN = Bits(28, doc="PWR")
    I2C3LPEN = Bits(23, doc="I2C3")
    I2C2LPEN = Bits(22, doc="I2C2")
    I2C1LPEN = Bits(21, doc="I2C1")
    USART2LPEN = Bits(17, doc="USART2")
    SPI3LPEN = Bits(15, doc="SPI3")
    SPI2LPEN = Bits(14, doc="SPI2")
    WWDGLPEN = Bits(11, doc="WWDG")
    TIM5LPEN = Bits(3, doc="TIM5")
    TIM4LPEN = Bits(2, doc="TIM4")
    TIM3LPEN = Bits(1, doc="TIM3")
    TIM2LPEN = Bits(0, doc="TIM2")


class APB2LPENR(Word, addr=0x64, reset=0x0007_7930, modelled=False):
    """Clocks of peripherals on APB2 in sleep mode."""

    TIM11LPEN = Bits(18, doc="TIM11")
    TIM10LPEN = Bits(17, doc="TIM10")
    TIM9LPEN = Bits(16, doc="TIM9")
    SYSCFGLPEN = Bits(14, doc="SYSCFG")
    SPI4LPEN = Bits(13, doc="SPI4")
    SPI1LPEN = Bits(12, doc="SPI1")
    SDIOLPEN = Bits(11, doc="SDIO")
    ADC1LPEN = Bits(8, doc="ADC1")
    USART6LPEN = Bits(5, doc="USART6")
    USART1LPEN = Bits(4, doc="USART1")
    TIM1LPEN = Bits(0, doc="TIM1")


class BDCR(Word, addr=0x70):
    """Backup domain control."""

    BDRST = Bits(16, doc="resets the backup domain")
    RTCEN = Bits(15, doc="RTC clock on")
    RTCSEL = Bits(9, 8, doc="clock of the RTC: none, LSE, LSI, HSE")
    LSEBYP = Bits(2, modelled=False, doc="LSE is a clock, not a crystal")
    LSERDY = Bits(1, access="r", doc="LSE is stable")
    LSEON = Bits(0, doc="LSE on")


class CSR(Word, addr=0x74, reset=0x0E00_0000):
    """Control and status."""

    LPWRRSTF = Bits(31, access="r", modelled=False, doc="reset on entering a low-power mode")
    WWDGRSTF = Bits(30, access="r", doc="reset by WWDG")
    IWDGRSTF = Bits(29, access="r", doc="reset by IWDG")
    SFTRSTF = Bits(28, access="r", doc="reset by software")
    PORRSTF = Bits(27, access="r", doc="power-on reset")
    PINRSTF = Bits(26, access="r", doc="reset by NRST")
    BORRSTF = Bits(25, access="r", doc="power-on or brown-out reset")
    RMVF = Bits(24, access="w", doc="clears the reset flags")
    LSIRDY = Bits(1, access="r", doc="LSI is stable")
    LSION = Bits(0, doc="LSI on")


class SSCGR(Word, addr=0x80, modelled=False):
    """Spread spectrum clock generation."""

    SSCGEN = Bits(31, doc="on")
    SPREADSEL = Bits(30, doc="down spread")
    INCSTEP = Bits(27, 13, doc="step")
    MODPER = Bits(12, 0, doc="period")


class PLLI2SCFGR(Word, addr=0x84, reset=0x2400_3000):
    """I2S PLL configuration."""

    PLLI2SR = Bits(30, 28, modelled=False, doc="divider for I2S")
    BIT26 = Bits(26, modelled=False, doc="unnamed bit; 1 after reset, then as written")
    PLLI2SN = Bits(14, 6, modelled=False, doc="multiplication factor")


class DCKCFGR(Word, addr=0x8C):
    """Dedicated clock configuration."""

    TIMPRE = Bits(24, doc="timers run at four times the clock of their bus")
