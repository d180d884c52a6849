"""Signals to a process and its children, which are in a process group of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress


def terminate_group(process: subprocess.Popen[bytes]) -> None:
    """Ask the processes to end. Windows has no such request, so this function has no effect there."""
    if sys.platform != "win32":
        _signal(process, signal.SIGTERM)


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """End the processes immediately; on Windows only the process itself.

    Call this only while the process has not been waited for: its id may then belong to another process.
    """
    if sys.platform == "win32":
        process.kill()
    else:
        _signal(process, signal.SIGKILL)


if sys.platform != "win32":

    def _signal(process: subprocess.Popen[bytes], number: int) -> None:
        with suppress(
            ProcessLookupError, PermissionError
        ):  # PermissionError: only zombies are left, on macOS
            os.killpg(process.pid, number)
