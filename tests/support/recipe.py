"""The sensor and the board of docs/recipes.md.

Blocks of that page that begin with the name of a file are these files. An import of this module makes ``htx221`` and
``greenhouse`` importable, directly from the page.
"""

from __future__ import annotations

import importlib
import re
import sys
import types
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[2] / "docs" / "recipes.md"
_FILE = re.compile(r"^```python\n# (\w+)\.py\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def sources() -> dict[str, str]:
    """Return the text of each file of the page, by the name of its module."""
    return dict(_FILE.findall(PAGE.read_text(encoding="utf-8")))


def _load() -> None:
    for name, source in sources().items():
        if name not in sys.modules:
            module = types.ModuleType(name)
            sys.modules[name] = module
            exec(compile(source, f"{PAGE.name}: {name}.py", "exec"), vars(module))


_load()
FILES = ("# htx221.py\n", "# greenhouse.py\n")
"""Beginnings of the blocks that have been loaded."""
HTX221: Any = importlib.import_module("htx221").HTX221
GreenhouseBoard: Any = importlib.import_module("greenhouse").GreenhouseBoard
