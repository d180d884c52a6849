"""Drivers of the three sensors.

They define the register constants again. If drivers and models shared them, tests could not detect a wrong address.
"""
