"""Real ARM firmware on the virtual board: an STM32F401.

- ``image`` reads firmware files.
- ``cpu`` is the Cortex-M4 with its exceptions and exact time.
- ``peripherals`` contains the chip's peripherals, one chapter of the reference manual (RM0368) each.
- ``firmware`` loads a program onto the board.
- ``native`` contains the code that runs continuously, including the processor, in C.
"""
