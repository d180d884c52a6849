"""The STM32F401's peripherals, one chapter of the reference manual RM0368 a file."""
