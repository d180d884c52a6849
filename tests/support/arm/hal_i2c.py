"""ST's HAL V1.6.0 for I2C as a sequence of register accesses, in the order of the HAL (master only).

Only the accesses come from the HAL; the bench handles time-outs.
"""

from __future__ import annotations

from tests.support.arm.comm_bench import CommBench

CR1, CR2, OAR1, DR, SR1, SR2, CCR, TRISE = 0x00, 0x04, 0x08, 0x10, 0x14, 0x18, 0x1C, 0x20  # RM0368 18.6
PE, START, STOP, ACK, POS, SWRST = 1 << 0, 1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 15
ITERREN, ITEVTEN, ITBUFEN, DMAEN, LAST = 1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12
SB, ADDR, BTF, RXNE, TXE = 1 << 0, 1 << 1, 1 << 2, 1 << 6, 1 << 7
BERR, ARLO, AF = 1 << 8, 1 << 9, 1 << 10
MSL, BUSY, TRA = 1 << 0, 1 << 1, 1 << 2
EVENT_IRQ, ERROR_IRQ = 33, 34  # I2C2 (RM0368 table 38)


class HalError(Exception):
    """The call returned HAL_ERROR or HAL_TIMEOUT."""


class HalI2c:
    """I2C2 of a bench after ``HAL_I2C_Init``."""

    def __init__(self, bench: CommBench, speed_hz: int = 400_000) -> None:
        self.bench = bench
        fast = speed_hz > 100_000
        self._write(CR1, 0)
        self._write(CR2, 42)
        self._write(TRISE, 42 * 300 // 1000 + 1 if fast else 43)
        self._write(CCR, 0x8000 | 42_000_000 // (3 * speed_hz) if fast else 42_000_000 // (2 * speed_hz))
        self._write(OAR1, 0x4000)
        self._set(CR1, PE)

    def mem_read(self, address: int, register: int, count: int) -> bytes:
        """Do HAL_I2C_Mem_Read, polled, with different endings for 1, 2, 3 and more bytes."""
        self._address_for_reading(address, register)
        if count == 1:
            self._clear(CR1, ACK)
            self._clear_addr()
            self._set(CR1, STOP)
        elif count == 2:
            self._clear(CR1, ACK)
            self._set(CR1, POS)
            self._clear_addr()
        else:
            self._clear_addr()
        return self._receive(count)

    def _receive(self, left: int) -> bytes:
        data = bytearray()
        while left:
            if left == 1:
                self._wait(RXNE)
                data.append(self._read(DR))
                left -= 1
            elif left == 2:
                self._wait(BTF)
                self._set(CR1, STOP)
                data += bytes((self._read(DR), self._read(DR)))
                left -= 2
            elif left == 3:
                self._wait(BTF)
                self._clear(CR1, ACK)
                data.append(self._read(DR))
                self._wait(BTF)
                self._set(CR1, STOP)
                data += bytes((self._read(DR), self._read(DR)))
                left -= 3
            else:
                self._wait(RXNE)
                data.append(self._read(DR))
                left -= 1
                if self._read(SR1) & BTF:
                    data.append(self._read(DR))
                    left -= 1
        return bytes(data)

    def mem_write(self, address: int, register: int, data: bytes) -> None:
        """Do HAL_I2C_Mem_Write, polled."""
        self._idle()
        self._send_address(address << 1)
        self._clear_addr()
        self._wait(TXE)
        self._write(DR, register)
        left = list(data)
        while left:
            self._wait(TXE)
            self._write(DR, left.pop(0))
            if left and self._read(SR1) & BTF:
                self._write(DR, left.pop(0))
        self._wait(BTF)
        self._set(CR1, STOP)

    def is_ready(self, address: int) -> bool:
        """Do HAL_I2C_IsDeviceReady with one trial."""
        self._idle()
        self._set(CR1, START)
        self.bench.poll(self.bench.i2c2, SR1, SB)
        self._write(DR, address << 1)
        answer = self.bench.poll(self.bench.i2c2, SR1, ADDR | AF)
        self._set(CR1, STOP)
        if answer & ADDR:
            self._clear_addr()
        else:
            self._write(SR1, ~AF)
        self.bench.poll_clear(self.bench.i2c2, SR2, BUSY)
        return bool(answer & ADDR)

    def receive_interrupt(self, address: int, count: int) -> bytes:
        """Do HAL_I2C_Master_Receive_IT and its handlers until the last byte."""
        data = bytearray()
        self._idle()
        self._set(CR1, ACK)
        self._set(CR1, START)
        self._set(CR2, ITEVTEN | ITERREN | ITBUFEN)

        def handler() -> None:
            flags = self._read(SR1)
            left = count - len(data)
            if flags & SB:
                self._write(DR, address << 1 | 1)
            elif flags & ADDR:
                self._addressed(count)
            elif flags & BTF:
                self._both_full(data, left)
            elif flags & RXNE and left > 3:
                data.append(self._read(DR))
            elif flags & RXNE and left == 1:
                self._clear(CR1, ACK)
                self._clear(CR2, ITEVTEN | ITERREN | ITBUFEN)
                data.append(self._read(DR))

        failed = self.bench.irq.level
        self.bench.serve(EVENT_IRQ, handler, lambda: len(data) == count or failed(ERROR_IRQ))
        if failed(ERROR_IRQ):
            self._clear(CR2, ITEVTEN | ITERREN | ITBUFEN)
            self._give_up()
        return bytes(data)

    def _addressed(self, count: int) -> None:
        if count <= 2:
            self._clear(CR1, ACK)
        if count == 2:
            self._set(CR1, POS)
        self._clear_addr()
        if count == 1:
            self._set(CR1, STOP)

    def _both_full(self, data: bytearray, left: int) -> None:
        if left in (3, 4):
            self._clear(CR2, ITBUFEN)
        if left == 3:
            self._clear(CR1, ACK)
        if left == 2:
            self._set(CR1, STOP)
            data.append(self._read(DR))
            data.append(self._read(DR))
            self._clear(CR2, ITEVTEN | ITERREN)
        else:
            data.append(self._read(DR))

    def mem_read_dma_address(self, address: int, register: int) -> None:
        """Do HAL_I2C_Mem_Read_DMA after the stream has been enabled: the address phase, then clear ADDR."""
        self._address_for_reading(address, register)
        self._set(CR2, LAST)
        self._set(CR2, DMAEN)
        self._clear_addr()

    def mem_read_dma_complete(self) -> None:
        """I2C_DMAXferCplt."""
        self._clear(CR1, ACK)
        self._set(CR1, STOP)
        self._clear(CR2, LAST)
        self._clear(CR2, DMAEN)

    def mem_write_dma_address(self, address: int, register: int) -> None:
        """Do HAL_I2C_Mem_Write_DMA before the stream is enabled."""
        self._idle()
        self._send_address(address << 1)
        self._clear_addr()
        self._wait(TXE)
        self._write(DR, register)
        self._wait(TXE)

    def mem_write_dma_data(self) -> None:
        """Enable the request line, after the stream has been enabled."""
        self._set(CR2, DMAEN)

    def mem_write_dma_complete(self) -> None:
        """Do I2C_DMAXferCplt and the event handler at BTF."""
        self._clear(CR2, DMAEN)
        self._wait(BTF)
        self._set(CR1, STOP)

    def wait_idle(self) -> None:
        self.bench.poll_clear(self.bench.i2c2, SR2, BUSY)

    # -- one access -------------------------------------------------------------------------------------

    def _address_for_reading(self, address: int, register: int) -> None:
        """Send the address, the register in the device, and the address again for reading; ADDR stays set."""
        self._idle()
        self._set(CR1, ACK)
        self._send_address(address << 1)
        self._clear_addr()
        self._wait(TXE)
        self._write(DR, register)
        self._wait(TXE)
        self._send_address(address << 1 | 1)

    def _idle(self) -> None:
        self.wait_idle()
        self._clear(CR1, POS)

    def _send_address(self, byte: int) -> None:
        self._set(CR1, START)
        self._wait(SB)
        self._write(DR, byte)
        if self.bench.poll(self.bench.i2c2, SR1, ADDR | AF) & AF:
            self._give_up()

    def _wait(self, flag: int) -> None:
        if self.bench.poll(self.bench.i2c2, SR1, flag | AF) & AF:
            self._give_up()

    def _give_up(self) -> None:
        self._set(CR1, STOP)
        self._write(SR1, ~AF)
        raise HalError

    def _clear_addr(self) -> None:
        self._read(SR1)
        self._read(SR2)

    def _read(self, offset: int) -> int:
        return self.bench.read(self.bench.i2c2, offset)

    def _write(self, offset: int, value: int) -> None:
        self.bench.write(self.bench.i2c2, offset, value)

    def _set(self, offset: int, bits: int) -> None:
        self.bench.modify(self.bench.i2c2, offset, set_bits=bits)

    def _clear(self, offset: int, bits: int) -> None:
        self.bench.modify(self.bench.i2c2, offset, clear=bits)
