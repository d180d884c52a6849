"""Boards in real time, which users move, watch and send text to."""
