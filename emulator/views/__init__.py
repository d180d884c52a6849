"""A run in files for other tools: wires for a logic analyser, a time line, a picture.

The views observe the board's trace and do not change the output.
"""
