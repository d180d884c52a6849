"""A run as files that other tools show: wires for a logic analyser, a time line, a picture.

They observe the board's trace and change nothing of what is printed.
"""
