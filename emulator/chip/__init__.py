"""The STM32F401 (reference manual RM0368) and its firmware."""
