"""The board: its sensors and wiring, its firmware, its terminal, and snapshots."""
