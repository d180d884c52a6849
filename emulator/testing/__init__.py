"""Tests of firmware with pytest and Hypothesis: strategies, the lab's properties, fixtures.

The properties need Hypothesis, which is installed with the package; the fixtures and test runs need pytest:
``pip install pytest``.
"""
