"""Tools for coding agents, by the Model Context Protocol: build, check, run, and a live board."""
