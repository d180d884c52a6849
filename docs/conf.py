"""The documentation as static pages: python -m sphinx -W -b html docs build/docs

The guides are the Markdown pages of this folder, as GitHub shows them; api/ is made from docstrings.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

project = "fcu-emulator"
copyright = "the fcu-emulator contributors"  # noqa: A001  Sphinx reads it by this name
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
html_theme = "furo"
html_title = "fcu-emulator"
html_static_path = ["_static"]
html_css_files = ["wrap.css"]
html_show_sphinx = False
html_copy_source = False

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
suppress_warnings = [
    "myst.xref_missing"
]  # links out of this folder (README, CONTRIBUTING), which tests check

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True}
autodoc_type_aliases = {"Signal": "Signal", "Array": "Array", "Matrix": "Matrix"}
python_maximum_signature_line_length = 88  # else one long line that a telephone breaks anywhere
python_use_unqualified_type_names = True
add_module_names = False
