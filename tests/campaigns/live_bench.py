"""Cost of the live board: ``python -m tests.campaigns.live_bench [SECONDS]``.

It measures:

- the CPU time of the server at real time, with one page that receives 50 states a second;
- the delay from a command to the truth on the wire (1,000 commands);
- the time from the start to the first state;
- the size of the page for a browser.
"""

from __future__ import annotations

import gzip
import json
import re
import statistics
import subprocess
import sys
import time
from importlib.resources import files
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection

from fcu_emulator.emulator.live.address import Address
from tests.support.live_fakes import connected

COMMANDS = 1000


def main() -> None:
    """Measure, and print a line for each figure."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    for firmware in ("lab3", "solution"):
        began_s = time.monotonic()
        program = [sys.executable, "-m", "fcu_emulator", "web", firmware, "--no-browser"]
        with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as server:
            assert server.stderr is not None
            url = next(found[0] for line in server.stderr if (found := re.search(r"http\S+", line)))
            with connected(address_of(url)) as client:
                state(client)
                print(f"{firmware}: first state {time.monotonic() - began_s:.2f} s after the start")  # noqa: T201
                measure_load(firmware, server.pid, client, seconds)
                if firmware == "solution":
                    measure_latency(client)
            server.terminate()
    page = files("fcu_emulator.emulator.live").joinpath("page")
    names = ("app.js", "app.css", "index.html", "icon.svg")
    size = sum(len(gzip.compress(page.joinpath(name).read_bytes())) for name in names)
    print(f"page: {size / 1000:.0f} kB compressed")  # noqa: T201


def address_of(url: str) -> Address:
    """Return the printed address."""
    parts = urlsplit(url)
    assert parts.port is not None
    return Address(parts.port, parts.fragment.removeprefix("token="))


def measure_load(firmware: str, pid: int, client: ClientConnection, seconds: float) -> None:
    """Return CPU time over wall time, and states per second."""
    before_s, began_s, states = cpu_s(pid), time.monotonic(), 0
    while time.monotonic() - began_s < seconds:
        state(client)
        states += 1
    took_s = time.monotonic() - began_s
    share = (cpu_s(pid) - before_s) / took_s
    print(f"{firmware}: {100 * share:.1f} % of a core, {states / took_s:.0f} states a second")  # noqa: T201


def measure_latency(client: ClientConnection) -> None:
    """Return the delays from a command to the state that shows its effect."""
    taken_ms = []
    for number in range(1, COMMANDS + 1):
        began_s = time.perf_counter()
        entry = {"do": "set_attitude", "roll_deg": number % 90}
        client.send(json.dumps({"type": "do", "entry": entry, "id": number}))
        while state(client)["done"] != number:
            pass
        taken_ms.append(1000 * (time.perf_counter() - began_s))
    middle, worst = statistics.median(taken_ms), max(taken_ms)
    print(f"command to truth: {middle:.1f} ms median, {worst:.1f} ms worst of {COMMANDS}")  # noqa: T201


def state(client: ClientConnection) -> dict[str, float]:
    """Return the next state."""
    while True:
        event: dict[str, float] = json.loads(client.recv(timeout=30))
        if event["type"] == "state":
            return event


def cpu_s(pid: int) -> float:
    """Return the CPU time of a process from Linux."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:  # noqa: PTH123 a file of the kernel's
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


if __name__ == "__main__":
    main()
