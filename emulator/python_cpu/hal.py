"""The HAL calls of Python firmware, timed as in ST's STM32F4 HAL V1.6.0.

Later versions of ST's HAL add one tick to ``HAL_Delay``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from fcu_emulator.emulator.boards.description import CallbackTimer
from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.clock import PS_PER_MS, Clock
from fcu_emulator.emulator.errors import I2CError, I2CStuckError
from fcu_emulator.emulator.python_cpu.cpu import Interrupt, PythonCpu
from fcu_emulator.emulator.python_cpu.timer import IntervalTimer
from fcu_emulator.emulator.trace import Trace

HAL_OK, HAL_ERROR, HAL_BUSY, HAL_TIMEOUT = range(4)


class HostedApplication(Protocol):
    """Functions of the firmware that the HAL calls."""

    def main(self) -> None:
        """Run from reset; never return."""
        ...

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """Handle the timer's interrupt."""
        ...


class HalGpio:
    """The HAL calls for pins."""

    def __init__(self, gpio: Gpio) -> None:
        self._gpio = gpio

    def HAL_GPIO_Init(self, port: str, pin: int) -> None:
        self._gpio.init_output(port, pin)

    def HAL_GPIO_InitInput(self, port: str, pin: int, pull: int | None = None) -> None:
        """Make a pin an input. ``pull``: 1 for a pull-up, 0 for a pull-down, None for no resistor."""
        self._gpio.release(port, pin)
        self._gpio.set_pull(port, pin, pull)

    def HAL_GPIO_ReadPin(self, port: str, pin: int) -> int:
        """Return the input level, 0 for a floating pin."""
        return self._gpio.reads(port, pin)

    def HAL_GPIO_WritePin(self, port: str, pin: int, state: int) -> None:
        self._gpio.write(port, pin, state)

    def HAL_GPIO_TogglePin(self, port: str, pin: int) -> None:
        self._gpio.write(port, pin, 0 if self._gpio.level(port, pin) else 1)


class VirtualHal(HalGpio):
    """The HAL of one board."""

    def __init__(
        self,
        clock: Clock,
        trace: Trace,
        cpu: PythonCpu,
        i2c: I2CBus,
        uart: Uart,
        gpio: Gpio,
        timer: CallbackTimer,
    ) -> None:
        super().__init__(gpio)
        self._clock = clock
        self._cpu = cpu
        self._i2c = i2c
        self._uart = uart
        self._sending = False
        self._transferring = False
        self._callback: Callable[[], None] | None = None
        interrupt = Interrupt(cpu, timer.priority, self._timer_irq_handler)
        self.timer = IntervalTimer(timer.peripheral, clock, trace, timer.input_hz, interrupt.set_pending)

    def link(self, application: HostedApplication) -> None:
        self._callback = application.HAL_TIM_PeriodElapsedCallback

    # -- time -------------------------------------------------------------------------------------------

    def HAL_GetTick(self) -> int:
        return self._clock.now_ps // PS_PER_MS

    def HAL_Delay(self, delay_ms: int) -> None:
        """Wait for ``delay_ms`` ticks. The first tick may be shorter than 1 ms."""
        self._cpu.wait_until((self.HAL_GetTick() + delay_ms) * PS_PER_MS)

    # -- I2C --------------------------------------------------------------------------------------------

    def HAL_I2C_Mem_Read(self, dev_address: int, mem_address: int, size: int) -> tuple[int, bytes]:
        """Return (status, data); HAL_BUSY if an interrupt handler calls this during a transfer of main()."""
        if self._transferring:
            return HAL_BUSY, b""
        bus, clock = self._i2c, self._clock
        try:
            data = bus.read_from(dev_address >> 1, mem_address, size)
        except I2CError as error:
            return self._i2c_failed(error), b""
        end_ps = bus.end_ps
        if clock.next_ps > end_ps:  # no event during the transfer, the usual case at 800 Hz
            clock.now_ps = end_ps
        else:
            self._transfer()
        return HAL_OK, data

    def HAL_I2C_Mem_Write(self, dev_address: int, mem_address: int, data: bytes) -> int:
        if self._transferring:
            return HAL_BUSY
        try:
            self._i2c.transfer(dev_address >> 1, bytes((mem_address,)) + data)
        except I2CError as error:
            return self._i2c_failed(error)
        self._transfer()
        return HAL_OK

    def _transfer(self) -> None:
        self._transferring = True
        try:
            self._cpu.elapse(self._i2c.end_ps - self._clock.now_ps)
        finally:
            self._transferring = False

    def _i2c_failed(self, error: I2CError) -> int:
        self._transfer()
        return HAL_BUSY if isinstance(error, I2CStuckError) else HAL_ERROR

    # -- serial line -----------------------------------------------------------------------------------------

    def HAL_UART_Transmit(self, data: bytes, timeout_ms: int) -> int:
        """Return after the last byte is sent. Return HAL_BUSY during another transmission."""
        if self._sending:
            return HAL_BUSY
        deadline_ps = (self.HAL_GetTick() + timeout_ms + 1) * PS_PER_MS
        self._sending = True
        try:
            while data:
                self._cpu.wait_until(self._uart.txe_ps)
                if self._clock.now_ps >= deadline_ps:
                    return HAL_TIMEOUT
                data = data[self._uart.send(data, min(self._clock.next_ps, deadline_ps)) :]
            self._cpu.wait_until(self._uart.idle_ps)
        finally:
            self._sending = False
        return HAL_OK

    def HAL_UART_Receive(self, size: int, timeout_ms: int) -> tuple[int, bytes]:
        """Return (status, bytes); HAL_TIMEOUT and fewer bytes after ``timeout_ms``."""
        deadline_ps = (self.HAL_GetTick() + timeout_ms + 1) * PS_PER_MS
        received = bytearray()
        while len(received) < size:
            self._cpu.wait_for(lambda: self._uart.rxne, deadline_ps)
            value = self._uart.read_data()
            if value is None:
                return HAL_TIMEOUT, bytes(received)
            received.append(value)
        return HAL_OK, bytes(received)

    # -- the timer ---------------------------------------------------------------------------------------

    def HAL_TIM_Base_Init(self, prescaler: int, period: int) -> None:
        self.timer.configure(prescaler, period)

    def HAL_TIM_Base_Start_IT(self) -> None:
        """Enable the timer's interrupt, then its counter.

        The callback runs immediately, because ``HAL_TIM_Base_Init`` has set the update flag.
        """
        self.timer.enable_interrupt()
        self._cpu.take_interrupts()
        self.timer.start()

    def _timer_irq_handler(self) -> None:
        self.timer.acknowledge()
        assert self._callback is not None
        self._callback()
