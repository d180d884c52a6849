"""Boards as data: soldered components, and the firmware supplied for them. No behaviour."""
