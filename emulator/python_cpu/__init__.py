"""The core, HAL and timer for firmware in Python."""
