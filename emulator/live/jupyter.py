"""The live board as a tile of JupyterLab, started by jupyter-server-proxy (extra ``jupyter``).

Decision: the random token is generated when the Jupyter server starts. The board gets it in its environment, and the
browser in the fragment of the tile's address, so that it is in no request line, in no log and on no command line. If
``fcu web`` generated the token, it would have to be read from the output.

Decision: if the hub's public address is known, ``fcu web`` compares Host and Origin with it. Otherwise only Jupyter
checks that Host and Origin match, and jupyter-server-proxy replaces both by the loopback address. So a direct call of
the port with another host is still refused.
"""

from __future__ import annotations

import os
import secrets
import sys
from importlib.resources import files
from typing import Any

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.live.public import TOKEN_VARIABLE, checked_behind

NAME = "fcu"
"""Name of the entry point, and the last part of the path prefix."""
ORIGIN_VARIABLE = "FCU_WEB_BEHIND"
"""Environment variable with the hub's origin, for hubs that do not set JUPYTERHUB_PUBLIC_URL."""
_START_S = 60  # a board starts in 2 s, and in a minute if a whole class starts at once


def live_board() -> dict[str, Any]:
    """Return the options of the server process for jupyter-server-proxy ("Server Process options").

    Raises InputError if FCU_WEB_BEHIND is not an origin.
    """
    token = secrets.token_urlsafe(24)
    origin = hub_origin()
    checked_by_jupyter = {"Host": "127.0.0.1:{port}", "Origin": "http://127.0.0.1:{port}"}
    options = ["--port", "{port}", "--base-path", f"{{base_url}}{NAME}/", "--no-browser"]
    if origin is not None:
        options += ["--behind", origin]
    return {
        "command": [sys.executable, "-m", "fcu_emulator", "web", *options],
        "environment": {TOKEN_VARIABLE: token},
        "absolute_url": True,
        "timeout": _START_S,
        "new_browser_tab": True,  # the page refuses to be shown in a frame
        "request_headers_override": checked_by_jupyter if origin is None else {},
        "launcher_entry": {
            "title": "FCU board",
            "path_info": f"{NAME}/#token={token}",
            "icon_path": str(files("fcu_emulator.emulator.live").joinpath("page", "icon.svg")),
        },
    }


def hub_origin() -> str | None:
    """Return the origin of the hub, if the operator or JupyterHub (from 5.0) has set it.

    Raises InputError if FCU_WEB_BEHIND is not an origin.
    """
    given = os.environ.get(ORIGIN_VARIABLE)
    if given:
        return checked_behind(given)
    scheme, slashes, rest = os.environ.get("JUPYTERHUB_PUBLIC_URL", "").partition("://")
    try:
        return checked_behind(f"{scheme}{slashes}{rest.partition('/')[0]}") if slashes else None
    except InputError:
        return None  # Jupyter checks the requests
