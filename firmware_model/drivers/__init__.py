"""Drivers of the three sensors, with register constants of their own.

The constants are transcribed from the datasheets a second time on purpose: an address shared with the sensor
models could be wrong in both places and nobody would notice.
"""
