"""The GDB remote serial protocol. Quoted names are sections of the appendix with this title in the GDB
manual.
"""
