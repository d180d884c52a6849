"""The STM32F401's peripherals, by chapter of RM0368."""
