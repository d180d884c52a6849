"""The GDB remote serial protocol: packets, the target description, commands, and the TCP server.

Named sections are those of the GDB manual's appendix "GDB Remote Serial Protocol".
"""
