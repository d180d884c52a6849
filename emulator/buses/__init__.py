"""Connections that transmit bytes and levels: I2C, SPI, USART and GPIO."""
