"""The board: sensors, wiring, firmware, terminal and snapshots."""
