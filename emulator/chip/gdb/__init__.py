"""The GDB remote serial protocol. Quoted names are sections of this appendix in the GDB manual."""
