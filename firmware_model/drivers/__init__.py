"""Drivers of the three sensors, with separate register constants.

The constants are transcribed from the datasheets a second time on purpose: tests could not detect a wrong
address that drivers and sensor models share.
"""
