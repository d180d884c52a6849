"""Tests of firmware with pytest and Hypothesis: strategies, the lab's properties, fixtures.

Needs the packages pytest and hypothesis: ``pip install 'fcu-emulator[test]'``.
"""
