"""Support for firmware tests with pytest and Hypothesis.

The fixtures need ``pip install pytest``.
"""
