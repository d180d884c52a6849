"""Thousands of messages that no page sends: ``python -m tests.campaigns.live_fuzz [COUNT]``.

They go to a served board over a WebSocket. Afterwards the board must still run, answer, and print.
"""

from __future__ import annotations

import json
import random
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from fcu_emulator.emulator.live.messages import commands

VALUES: list[Any] = [
    None, True, False, 0, -1, 1, 10**30, -(2**63), 0.5, 1e308, -1e308, "", "x", "\0", "é" * 300,
    "LSM6DSL", "solution", "tick", "1s", "1e9h", [], [[]], {}, {"do": "lift"}, ["x"] * 20, "../../etc/passwd",
    {"do": "send", "hex": "00"}, {"do": "send", "text": "\x1b]0;x\x07<script>"},
    {"do": "follow_attitude", "roll_deg": 1e30},
    {"do": "follow_altitude", "metres": 1, "time_constant": "0s"},
    {"do": "shake", "axis": "up", "amplitude_g": 1000, "frequency_hz": 0.01, "for": "1000s"},
    {"do": "figure_eight", "for": "1us", "turns": 100}, {"do": "free_fall", "for": "100h"},
    {"do": "inject_fault", "kind": "stuck", "for": "1us"}, {"do": "replay", "csv": "/etc/passwd"},
]  # fmt: skip

NAMES = ["entry", "id", "of", "factor", "name", "data", "scenario", "variables", "registers", "bus", "x"]


def fuzzed(seed: int, count: int) -> Iterator[str | bytes]:
    """Return commands with wrong fields and values, damaged JSON, and bytes."""
    rng = random.Random(seed)
    kinds = [*commands(), "state", "hello", "", "do"]
    for _ in range(count):
        message: dict[str, Any] = {"type": rng.choice(kinds)}
        for name in rng.sample(NAMES, 4):
            message[name] = rng.choice(VALUES)
        if rng.random() < 0.5 and message["type"] in commands():
            hints = commands()[message["type"]].__dataclass_fields__
            message = {"type": message["type"], **{name: rng.choice(VALUES) for name in hints}}
        text = json.dumps(message)
        match rng.randrange(8):
            case 0:
                yield text[: rng.randrange(len(text))]
            case 1:
                yield rng.randbytes(rng.randrange(200))
            case 2:
                yield "[" * rng.randrange(20_000)
            case 3:
                yield text.replace('"', rng.choice(["'", "", "\\u0000"]), rng.randrange(4))
            case _:
                yield text


def main() -> None:
    """Send the messages, and print the state of the board."""
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import ClientConnection

    from fcu_emulator.emulator.live.server import PageServer
    from fcu_emulator.emulator.live.session import LiveSession
    from fcu_emulator.emulator.live.setup import Setup
    from tests.support.live_fakes import connected

    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    pages = PageServer()
    session = LiveSession(Setup("solution"), pages.publish)
    pages.controls = session

    def attack() -> None:
        try:
            with connected(pages.address) as client:
                taken = threading.Event()

                def hear(client: ClientConnection = client, taken: threading.Event = taken) -> None:
                    with suppress(ConnectionClosed):
                        for event in client:
                            if str(event).startswith('{"type":"recorded"'):
                                taken.set()

                threading.Thread(target=hear, daemon=True).start()
                for message in fuzzed(1, count):
                    client.send(message)
                client.send('{"type":"record"}')
                while not taken.wait(1):
                    pass
            with connected(pages.address) as client:
                client.send('{"type":"firmware","name":"solution"}')
                client.send('{"type":"run"}')
                client.send('{"type":"speed","factor":1}')
                printed = ""
                while "Pitch:" not in printed:
                    event = json.loads(client.recv(timeout=60))
                    printed += event.get("text", "") if event["type"] == "text" else ""
            print(f"{count} messages; the board runs, and prints")  # noqa: T201
        finally:
            session.stop()

    attacker = threading.Thread(target=attack)
    attacker.start()
    session.run()
    attacker.join()
    pages.close()


if __name__ == "__main__":
    main()
