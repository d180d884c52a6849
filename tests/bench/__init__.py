"""Benchmarks: ``python -m tests.bench`` prints the table. Figures are printed, never asserted."""
