"""Boards as data: their components, and the firmware supplied for them. They have no behaviour."""
