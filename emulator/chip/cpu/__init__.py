"""The interface of the Cortex-M4 core in Python: running, registers, faults, peripherals by address."""
