"""Firmware tests with pytest and Hypothesis: strategies, the lab's properties, fixtures.

The fixtures need ``pip install pytest``.
"""
