"""Benchmarks: ``python -m tests.bench`` prints the table. The figures are only printed, not asserted."""
