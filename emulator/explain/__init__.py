"""Find the first value that firmware computes differently from a lab's formulas, and the source line."""
