"""Find the first value that a firmware computes differently from a lab's formulas, and the line that does."""
