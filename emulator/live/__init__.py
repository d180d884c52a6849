"""Boards in real time. Users can move a board, watch it, and send text to it."""
