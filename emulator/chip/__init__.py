"""Real ARM firmware on the virtual board: an STM32F401.

``image`` reads the files a student has, ``cpu`` is the Cortex-M4 with its exceptions and exact time,
``peripherals`` are the chip's peripherals, one chapter of the reference manual (RM0368) each, and ``firmware``
puts them on the board. What firmware touches all the time, the processor included, is in C (``native``).
"""
