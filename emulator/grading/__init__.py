"""Grading: rubrics, and the verdicts on programs.

The package imports no modules, because one is named ``judge``.
"""
