"""Drivers of the three sensors.

Their register constants are separate from the models', so tests can detect a wrong address.
"""
