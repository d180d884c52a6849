"""The GDB remote serial protocol. Quoted names are sections of the GDB manual."""
