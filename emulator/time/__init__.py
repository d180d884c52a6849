"""Virtual time: the clock, its events, and durations."""
