"""The processor that firmware in Python runs on: its core, its HAL and its timer."""
