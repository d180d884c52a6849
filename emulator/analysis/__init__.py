"""What is made of runs afterwards: recorded observations, replays, comparisons and the fidelity table."""
