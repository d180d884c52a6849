"""The GDB remote serial protocol; section names are those of that appendix in the GDB manual."""
