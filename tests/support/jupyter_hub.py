"""A real JupyterHub on free ports of 127.0.0.1, with its proxy, a folder for each user, and any password."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import suppress
from pathlib import Path

START_S = 120.0
_SETTINGS = """\
c = get_config()
c.JupyterHub.bind_url = "http://127.0.0.1:{public}"
c.JupyterHub.hub_bind_url = "http://127.0.0.1:{hub}"
c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:{api}"
c.ConfigurableHTTPProxy.pid_file = "{folder}/proxy.pid"
c.JupyterHub.cookie_secret_file = "{folder}/cookie_secret"
c.JupyterHub.db_url = "sqlite:///{folder}/hub.sqlite"
c.JupyterHub.authenticator_class = "dummy"
c.Authenticator.allow_all = True
c.JupyterHub.spawner_class = "simple"
c.SimpleLocalProcessSpawner.home_dir_template = "{folder}/{{username}}"
c.Spawner.args = ["--allow-root", "--ServerApp.log_level=INFO"]
c.Spawner.default_url = "/lab"
c.Spawner.start_timeout = 120
c.Spawner.http_timeout = 120
c.Spawner.environment = {{"XDG_RUNTIME_DIR": "{folder}/run"}}
c.JupyterHub.public_url = "{told}"
"""


class Hub:
    """JupyterHub with its log in ``folder``. If ``tells_address``, its public address is set."""

    def __init__(self, folder: Path, tells_address: bool) -> None:
        public, hub, api = _free_ports(3)
        self.origin = f"http://127.0.0.1:{public}"
        self._log = folder / "hub.log"
        (folder / "run").mkdir(mode=0o700)
        settings = _SETTINGS.format(
            public=public, hub=hub, api=api, folder=folder, told=self.origin if tells_address else ""
        )
        (folder / "config.py").write_text(settings, encoding="utf-8")
        environment = {name: value for name, value in os.environ.items() if "JUPYTER" not in name}
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "jupyterhub", "--config", str(folder / "config.py")],
                cwd=folder,
                env=environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        try:
            self._wait()
        except BaseException:
            self.close()
            raise

    def log(self) -> str:
        """Return the output of the hub, its proxy and the servers of its users."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    def close(self) -> None:
        """End the hub, which ends its proxy and its users' servers."""
        boards = [number for number, _ in processes("--base-path")]
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(60)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        left = {number for number, _ in processes("--base-path")}
        assert not left.intersection(boards), self.log()

    def _wait(self) -> None:
        end = time.monotonic() + START_S
        while time.monotonic() < end and self._process.poll() is None:
            try:
                with urllib.request.urlopen(f"{self.origin}/hub/health", timeout=5):
                    return
            except OSError:
                with suppress(subprocess.TimeoutExpired):
                    self._process.wait(0.2)
        raise AssertionError(f"JupyterHub did not start:\n{self.log()}")


def processes(word: str) -> list[tuple[int, str]]:
    """Return ids and command lines of this machine's processes with ``word`` among their arguments (Linux)."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            arguments = file.read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if word in arguments:
            found.append((int(file.parent.name), " ".join(arguments)))
    return found


def board_port(user: str) -> int:
    """Return the port of a user's board, from its command line."""
    commands = [line for _, line in processes("--base-path") if f"--base-path /user/{user}/fcu/" in line]
    assert len(commands) == 1, commands
    found = re.search(r"--port (\d+)", commands[0])
    assert found
    return int(found[1])


def _free_ports(count: int) -> list[int]:
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in held]
    for one in held:
        one.close()
    return ports
