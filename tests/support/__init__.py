"""Helpers of the tests: fakes, programs for the chip, oracles and reference models."""
