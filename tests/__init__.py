"""Tests of the virtual board; test doubles are imported as ``tests.support.<name>``."""
