"""What carries bytes and levels on the board: I2C, SPI, USART and GPIO, and who masters them from Python."""
