"""The Cortex-M4 core as Python sees it: running, registers, faults, peripherals by address."""
