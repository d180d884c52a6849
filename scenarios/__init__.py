"""Scenarios that come with the emulator: TOML files, each with the question it asks on top.

``fcu scenarios`` lists them; ``Board(scenario="stairs")`` runs one by name.
"""
