"""Carriers of bytes and levels on the board: I2C, SPI, USART and GPIO."""
