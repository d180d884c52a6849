"""Long measurements and attacks, each a command: ``python -m tests.campaigns.NAME``."""
