"""TCP ports that only this machine's programs can reach.

Decision: serial ports, the debugger's port and the control port listen on 127.0.0.1 only. Other
machines connect through ``ssh -L``. Only the web page can use another address, because it requires
a token.
"""

from __future__ import annotations

import socket
import sys

from fcu_emulator.emulator.errors import LinkError

HOST = "127.0.0.1"
LARGEST_PORT = 65_535


def listen(port: int, option: str) -> socket.socket:
    """Return a socket on ``port`` (0: any free port). Raises LinkError, which names ``option``."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if sys.platform == "win32":  # on Windows, SO_REUSEADDR lets two programs share a port
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:  # a port can be reused as soon as a program has closed it
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((HOST, port))
        listener.listen()
    except (OSError, OverflowError) as error:
        listener.close()
        reason = getattr(error, "strerror", None) or error
        problem = f"{option}: {reason}; give another port of {HOST}, or 0 for a free one"
        raise LinkError(problem, kind="port_not_free") from error
    return listener
