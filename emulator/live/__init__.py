"""Live boards: a board runs in real time while users move it, send text to it and watch it."""
