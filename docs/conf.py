"""The documentation as static pages: python -m sphinx -W -b html docs build/docs

The guides are the Markdown pages of this folder, as GitHub shows them; api/ is generated from docstrings.
"""

from __future__ import annotations

import sys
from pathlib import Path

from sphinx.application import Sphinx

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

MOVED = {
    "drivers": "python-api",
    "faq": "troubleshooting",
    "new-sensor-and-board": "recipes",
    "signal_chain": "fidelity",
    "teacher": "grading",
    "views": "compare",
}
"""Pages of the previous release, with the page that has their contents now."""


def setup(app: Sphinx) -> None:
    """Redirect the addresses of moved pages."""
    app.connect("build-finished", redirect)


def redirect(app: Sphinx, error: Exception | None) -> None:
    """Write a page at each old address that opens the new one."""
    if error is None and app.builder.format == "html":
        for old, new in MOVED.items():
            page = f'<!doctype html><title>{new}</title><meta http-equiv="refresh" content="0; url={new}.html">\n'
            (Path(app.outdir) / f"{old}.html").write_text(page, encoding="utf-8")
