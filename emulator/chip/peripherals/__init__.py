"""The STM32F401's peripherals; each file implements one chapter of the reference manual RM0368."""
