"""Scenarios that come with the emulator: TOML files, each with the question it asks on top.

``fcu scenarios`` lists them; ``Board(scenario="stairs")`` runs one by name.
"""

if not __name__.startswith("fcu_emulator."):  # imported by its former name
    from fcu_emulator._old_names import redirect

    redirect(__name__)
