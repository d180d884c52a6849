"""Drivers of the three sensors.

Register constants are transcribed again, because tests could not detect a wrong address shared with the models.
"""
