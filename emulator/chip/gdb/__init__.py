"""The GDB remote serial protocol: packets, what the board says of itself, commands, and the TCP server.

Named sections are those of the GDB manual's appendix "GDB Remote Serial Protocol".
"""
