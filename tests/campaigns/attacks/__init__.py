"""Campaigns against everything that takes something from strangers: ``python -m tests.campaigns.attacks``."""
