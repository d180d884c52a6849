"""Grading: rubrics, and the verdicts on programs.

The package imports none of its modules, because one module has the name ``judge``.
"""
