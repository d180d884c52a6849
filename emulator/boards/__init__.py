"""Boards as data: what is soldered where, and which firmware is shipped for it. No behaviour."""
