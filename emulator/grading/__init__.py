"""Grading: rubrics, and what a program gets by them.

::

    from fcu_emulator.emulator.grading.judge import judge
    from fcu_emulator.emulator.grading.rubric import load_rubric

    verdict = judge("lab3.elf", load_rubric("lab3"), seed=7)
    print(verdict.points, "of", verdict.max_points)

``rubric`` reads the file, ``checks`` has the kinds of checks that scenarios lack, ``judge`` runs the board,
and ``verdict`` is what comes of it. Nothing is loaded by importing the package: ``judge`` is a module here.
"""
