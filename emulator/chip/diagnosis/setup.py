"""Detection of peripherals that were configured wrongly or not at all.

The functions in the firmware show the intention of the program.
"""

from __future__ import annotations

from fcu_emulator.emulator.boards.description import BoardSignals
from fcu_emulator.emulator.buses.gpio import parse_pin
from fcu_emulator.emulator.buses.uart import BAUD
from fcu_emulator.emulator.chip.chip import Chip
from fcu_emulator.emulator.chip.cpu.exceptions import FIRST_INTERRUPT, bits
from fcu_emulator.emulator.chip.diagnosis.backtrace import CALLBACK, Places
from fcu_emulator.emulator.chip.diagnosis.evidence import absent
from fcu_emulator.emulator.chip.diagnosis.hang import exception_name
from fcu_emulator.emulator.chip.diagnosis.report import Cause, Diagnosis, section
from fcu_emulator.emulator.chip.peripherals.tim import Timer
from fcu_emulator.emulator.clock import PS_PER_S

_SPEAKS = ("HAL_UART_Transmit", "HAL_UART_Transmit_IT", "HAL_UART_Transmit_DMA")
_TALKS_TO_SENSORS = (
    "HAL_I2C_Mem_Read",
    "HAL_SPI_Receive",
    "HAL_SPI_TransmitReceive",
    "HAL_I2C_Master_Receive",
)
_HAL_TIM = "stm32f4xx_hal_tim.c"  # contains the default callback
_LAB = (b"ACC[x,y,z]", b"Pitch:")

_SILENT_PS = PS_PER_S // 2  # a correct program has begun its output by then
_CR1, _DIER, _PSC, _ARR, _USART_CR1, _BRR = 0x00, 0x0C, 0x28, 0x2C, 0x0C, 0x08
_PE, _CEN, _UIE, _SPE, _UE, _TE = 1, 1, 1, 1 << 6, 1 << 13, 1 << 3
_USART2_FUNCTION = 7  # AF7 (DS9716 table 9)
_FURTHEST_OFF = 0.03  # larger errors of a baud rate garble bytes (AN3155 allows 2 to 3 %)
_LAB_RATES_HZ = (800.0, 84e6 / 52 / 2000)  # the rates of the lab and of ST's examples
_NEAR = 0.005
_TICK_HZ = 1000.0  # rate of the HAL's time base


# -- the terminal -------------------------------------------------------------------------------------------


def silent_terminal(chip: Chip, signals: BoardSignals, places: Places) -> Diagnosis | None:
    """Report output that does not reach the terminal."""
    prints = places.address_of(*_SPEAKS)
    if prints is None or signals.clock.now_ps < _SILENT_PS or signals.uart.received_count():
        return None
    number = signals.board.serial.peripheral
    usart, init = chip.core.peripherals[number], f"MX_{number}_UART_Init()"
    port, pin, function = signals.board.serial.tx
    control = usart.peek(_USART_CR1)
    main = places.place(places.address_of("main") or 0)
    if not control & _UE:
        short = f"{number} is not set up: {init} is not called"
        why = f"UE in {number}_CR1 is 0, so HAL_UART_Transmit() fails at once and PRINTF prints nothing."
        look = f"Call it in {main}, after the set-up of the clocks and before the first PRINTF."
    elif not control & _TE:
        short = f"{number}'s transmitter is off"
        why = f"TE in {number}_CR1 is 0: Init.Mode must be UART_MODE_TX_RX."
        look = f"Check {init}."
    elif signals.gpio.alternate(port, pin) != function:
        short = f"P{port}{pin} is not switched to {number}"
        alternate = f"GPIO_AF{function}_{number}"
        why = f"The output of {number} does not reach the pin: use GPIO_MODE_AF_PP with Alternate = {alternate}."
        look = f"Check the pins in {init} or HAL_UART_MspInit()."
    else:
        return None
    return Diagnosis("terminal", f"no output: {short}", (why, look), fatal=False)


_LINES_SHOWN = 8


def printed_elsewhere(chip: Chip, signals: BoardSignals) -> Diagnosis | None:
    """Report output on another USART, if the terminal got no output."""
    output = chip.usarts.unconnected_output()
    if not output or signals.uart.received_count():
        return None
    name, data = max(output.items(), key=lambda item: len(item[1]))
    board = signals.board.serial.peripheral
    lines = [line for line in data.decode(errors="replace").splitlines() if line.strip()]
    details = [f"This board's terminal is on {board}."]
    if name == "USART2" and signals.gpio.alternate("A", 2) == _USART2_FUNCTION:
        details.append(
            "USART2 on PA2 is the terminal of ST's Nucleo boards; was the program made for such a board?"
        )
    details += section(f"the first lines on {name}", lines[:_LINES_SHOWN])
    return Diagnosis(
        "terminal", f"the program prints on {name}, which has no terminal", tuple(details), fatal=False
    )


def wrong_baud(chip: Chip, signals: BoardSignals) -> Diagnosis | None:
    """Report output that a real terminal would show as garbage."""
    if chip.low_power.in_stop:  # the program selects its clocks when it wakes
        return None
    name = signals.board.serial.peripheral
    usart = chip.core.peripherals[name]
    divider = usart.peek(_BRR)
    if not divider or not signals.uart.received_count():
        return None
    eights = usart.peek(_USART_CR1) >> 15 & 1
    counted = 2 * (divider & 0xFFF0 | (divider & 7) << 1) // 2 if eights else divider
    clock_hz = clock_of(name, chip)
    baud = clock_hz * (1 + eights) / counted if counted else 0.0
    if abs(baud / BAUD - 1) <= _FURTHEST_OFF:
        return None
    return Diagnosis(
        "terminal",
        f"{name} sends at {baud:.0f} baud; the terminal on your laptop listens at {BAUD}",
        (
            f"BRR is {divider} and the peripheral's clock is {clock_hz / 1e6:g} MHz.",
            "The text is readable here; a terminal of the real board would show garbage.",
            f"Check Init.BaudRate in MX_{name}_UART_Init(); SystemClock_Config() must be called before it.",
        ),
        fatal=False,
    )


def clock_of(name: str, chip: Chip) -> int:
    """Return a USART's clock: APB1 for USART2, else APB2 (RM0368 section 2.3)."""
    return chip.soc.clocks.pclk1_hz if name == "USART2" else chip.soc.clocks.pclk2_hz


# -- the sensors' bus ---------------------------------------------------------------------------------------


def _other_bus_on(chip: Chip, signals: BoardSignals) -> str:
    wired = {*signals.board.buses(), *(part.spi for part in signals.board.absent)}
    for name, peripheral in chip.core.peripherals.items():
        bit = {"I2C": _PE, "SPI": _SPE}.get(name[:3], 0)
        if bit and name not in wired and peripheral.peek(_CR1) & bit:
            return name
    return ""


def bus_never_on(chip: Chip, signals: BoardSignals, places: Places) -> Cause | None:
    """Report firmware that contains bus functions but has not switched a bus on."""
    peripherals = chip.core.peripherals
    talks = places.address_of(*_TALKS_TO_SENSORS) is not None
    used = any(bus.recent_transfers() for bus in signals.i2c.values()) or any(
        bus.recent_transfers() or bus.unaddressed for bus in signals.spi.values()
    )
    on = any(peripherals[name].peek(_CR1) & _PE for name in signals.i2c) or any(
        peripherals[name].peek(_CR1) & _SPE for name in signals.spi
    )
    if not talks or used or on:
        return None
    if elsewhere := _other_bus_on(chip, signals):
        return Cause(f"{elsewhere} is set up, but no sensor is connected to it", [absent(signals, elsewhere)])
    bits_off = [
        *(f"PE in {name}_CR1" for name in signals.i2c),
        *(f"SPE in {name}_CR1" for name in signals.spi),
    ]
    verb = "are" if len(bits_off) > 1 else "is"
    calls = " or ".join(f"MX_{name}_Init()" for name in signals.board.buses())
    return Cause(
        "the sensors' bus was never set up",
        [
            f"{' and '.join(bits_off)} {verb} 0, and there were no transfers.",
            (
                f"Call MX_SensorBus_Init() (in CubeMX's projects {calls}) in "
                f"{places.place(places.address_of('main') or 0)}, before the sensors are set up."
            ),
        ],
    )


_RXNE, _BSY = 1 << 0, 1 << 7
_SR = 0x08


def byte_left(chip: Chip, signals: BoardSignals) -> Cause | None:
    """Report a received byte that was left in the DR of an idle SPI."""
    for name, bus in signals.spi.items():
        status = chip.core.peripherals[name].peek(_SR)
        idle = all(signals.gpio.level(*parse_pin(select)) for select in bus.chip_selects)
        if bus.chip_selects and idle and status & (_RXNE | _BSY) == _RXNE:
            return _left_in(name)
    return None


def _left_in(name: str) -> Cause:
    return Cause(
        f"a received byte was left in {name}_DR, so each read returns the previous byte",
        [
            f"RXNE in {name}_SR is 1 while no chip select is low and no byte is being transferred.",
            (
                "While one data line receives (BIDIOE = 0), the clock runs until SPE is cleared: "
                "clear SPE before the last byte has arrived, or read DR once more (RM0368 20.3.5)."
            ),
        ],
    )


# -- timers and interrupts ----------------------------------------------------------------------------------


def not_enabled(chip: Chip) -> Diagnosis | None:
    """Report a requested interrupt that is not enabled in the NVIC."""
    core = chip.core
    waiting = core.pending & ~core.enabled & ~core.active
    for number in bits(waiting >> FIRST_INTERRUPT << FIRST_INTERRUPT):
        name = exception_name(number)
        if not name.startswith(("TIM", "DMA", "I2C", "SPI", "USART")):
            continue
        return Diagnosis(
            "timer" if name.startswith("TIM") else "bus",
            f"the interrupt {name} is requested but not enabled in the NVIC",
            (
                "The peripheral's flag and interrupt enable bit are set, but the bit in NVIC_ISER is 0.",
                f"HAL_NVIC_EnableIRQ({name}_IRQn) is missing; call it in the peripheral's set-up.",
            ),
            fatal=False,
        )
    return None


def never_ticked(chip: Chip, signals: BoardSignals, places: Places) -> Diagnosis | None:
    """Report a timer callback that no timer has called."""
    if signals.clock.now_ps < 2 * PS_PER_S or any(timer.ticks for timer in chip.timers.values()):
        return None
    callback = places.address_of(CALLBACK)
    if callback is None or places.file(callback) in (
        _HAL_TIM,
        "",
    ):  # this check comes at the end, because it reads all line numbers
        return None
    what, why = _why_no_ticks(chip, signals.board.timer.peripheral)
    where = places.place(callback)
    return Diagnosis(
        "timer", f"{CALLBACK}() was never called: {what}", (why, f"The callback is {where}."), False
    )


def _why_no_ticks(chip: Chip, usual: str) -> tuple[str, str]:
    for timer in chip.timers.values():
        control, enable = timer.peek(_CR1), timer.peek(_DIER)
        if control & _CEN and not enable & _UIE:
            return (
                f"{timer.name} counts without its interrupt",
                f"UIE in {timer.name}_DIER is 0: use HAL_TIM_Base_Start_IT(), not HAL_TIM_Base_Start().",
            )
        if timer.clocked and timer.peek(_PSC) and not control & _CEN:
            return (
                f"{timer.name} is set up but was not started",
                f"CEN in {timer.name}_CR1 is 0: HAL_TIM_Base_Start_IT() is missing.",
            )
    return "no timer is set up", f"MX_{usual}_Init() and HAL_TIM_Base_Start_IT() are missing."


def wrong_rate(chip: Chip, signals: BoardSignals) -> Diagnosis | None:
    """Report a lab timer with a rate other than 800 Hz."""
    if not any(word in signals.uart.received() for word in _LAB):
        return None
    timers = [timer for timer in chip.timers.values() if timer.ticks > 1 and timer.rate_hz]
    timers = [timer for timer in timers if abs(timer.rate_hz / _TICK_HZ - 1) > _NEAR]
    if not timers or any(_is_lab_rate(timer) for timer in timers):
        return None
    timer = timers[0]
    prescaler, period = timer.peek(_PSC), timer.peek(_ARR)
    clock_hz = round(timer.rate_hz * (prescaler + 1) * (period + 1))
    details = [
        (
            f"{clock_hz / 1e6:g} MHz / ({prescaler} + 1) / ({period} + 1): the registers contain these divisors minus one. "
            f"For 800 Hz (PSC + 1) x (ARR + 1) is {clock_hz / 800:.0f}, such as 84 x 1250."
        ),
        f"Check Init.Prescaler and Init.Period in MX_{timer.name}_Init().",
    ]
    return Diagnosis(
        "timer",
        f"{timer.name} ticks at {timer.rate_hz:.6g} Hz; the lab's rate is 800 Hz",
        tuple(details),
        False,
    )


def _is_lab_rate(timer: Timer) -> bool:
    return any(abs(timer.rate_hz / rate - 1) <= _NEAR for rate in _LAB_RATES_HZ)
