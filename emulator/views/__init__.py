"""A run in files for other tools: wires for a logic analyser, a time line, a picture."""
