"""Rubrics that come with the emulator: TOML files that say how a lab's programs are judged.

``load_rubric("lab3")`` reads one by name; how to write one: docs/rubrics.md.
"""
