"""Virtual time: the board's clock and its queue of events, and durations as users write them."""
