"""Evaluation of runs: observations, replays, comparisons and fidelity."""
