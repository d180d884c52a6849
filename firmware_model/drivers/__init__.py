"""Drivers of the three sensors.

The drivers' register constants are separate from the models' constants, so tests can detect a wrong address.
"""
