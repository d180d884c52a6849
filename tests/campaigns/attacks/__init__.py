"""Campaigns against all parts that accept untrusted input: ``python -m tests.campaigns.attacks``."""
