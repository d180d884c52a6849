"""The board: its parts and wiring, the firmware it boots, its terminal, and snapshots of all of it."""
