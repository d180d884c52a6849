"""The STM32F401: firmware files, Cortex-M4 and peripherals (reference manual RM0368), with the fast part in C."""
