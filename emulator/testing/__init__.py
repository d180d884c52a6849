"""Support for tests of firmware with pytest and Hypothesis: strategies, the lab's properties, fixtures.

The fixtures need pytest: ``pip install pytest``.
"""
