"""Grading: rubrics, and the verdicts on programs.

The package imports none of its modules, because ``judge`` is a module here.
"""
