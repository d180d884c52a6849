"""Codes that several registers share, for their descriptions."""

ODR = "0 off, 1 to 10: 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664 Hz"
DECIMATION = "0 not in FIFO, 1 every sample, 2 1/2, 3 1/3, 4 1/4, 5 1/8, 6 1/16, 7 1/32"
