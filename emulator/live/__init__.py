"""Live boards: a board runs in real time while users move it, type to it and watch it."""
