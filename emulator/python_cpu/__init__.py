"""The processor that runs firmware in Python: its core, its HAL and its timer."""
