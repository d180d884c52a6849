"""Evaluation of runs: recorded observations, replays, comparisons and the fidelity table."""
