"""Grading: rubrics, and the verdicts on programs.

::

    from fcu_emulator.emulator.grading.judge import judge
    from fcu_emulator.emulator.grading.rubric import load_rubric

    verdict = judge("lab3.elf", load_rubric("lab3"), seed=7)
    print(verdict.points, "of", verdict.max_points)

``rubric`` reads the file, ``checks`` has the kinds of checks that scenarios lack, ``judge`` runs the board,
and ``verdict`` holds the result. Importing the package loads no module, because ``judge`` is a module here.
"""
