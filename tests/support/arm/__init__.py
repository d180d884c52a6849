"""Helpers of the tests of the chip, and of its programs in tests/arm."""
