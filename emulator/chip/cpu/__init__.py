"""The Python interface of the Cortex-M4 core."""
