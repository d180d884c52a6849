"""Drivers of the three sensors.

Their register constants are separate from the models'. Tests can therefore detect a wrong address.
"""
