"""Tests of the virtual board. Helpers are imported as ``tests.support.<name>``."""
