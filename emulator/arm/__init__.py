"""Real ARM firmware on the virtual board: an STM32F401 whose core is Unicorn and whose peripherals are ours.

``image`` reads the files a student has, ``cpu`` is the Cortex-M4 with its exceptions and exact time,
``peripherals`` are the chip's blocks, one chapter of the reference manual (RM0368) each, and ``firmware``
puts them on the board. Only ``cpu/unicorn_engine.py`` and ``cpu/registers.py`` know Unicorn.
"""
