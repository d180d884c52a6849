"""A session in the thread of a test, as fast as possible, on a wall clock of the test."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from fcu_emulator.emulator.links import ByteLink
from fcu_emulator.emulator.live import messages
from fcu_emulator.emulator.live.address import Address
from fcu_emulator.emulator.live.exercises import Exercises
from fcu_emulator.emulator.live.messages import PageCommand, SessionEvent
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.emulator.python_cpu.hal import VirtualHal


class Wall:
    """A wall clock on which time passes by reads and waits, the same on every machine."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        self.now_s += 1e-5
        return self.now_s

    def wait(self, event: threading.Event, timeout_s: float) -> None:
        """Let time pass; no other thread can set the event during the wait."""
        if not event.is_set():
            self.now_s += timeout_s


class Page:
    """A client that sends ``script``, (virtual seconds, command), and ends the session after ``end_s``.

    Firmware that has failed and is not replaced also ends the session, because virtual time then stops before
    ``end_s``.
    """

    def __init__(
        self,
        setup: Setup,
        script: Sequence[tuple[float, PageCommand]] = (),
        end_s: float = 1.0,
        record: Path | None = None,
        on_event: Callable[[SessionEvent], None] = lambda _event: None,
        links: Sequence[ByteLink] = (),
        exercises: Exercises | None = None,
    ) -> None:
        self.events: list[SessionEvent] = []
        self._script = list(script)
        self._end_s = end_s
        self._on_event = on_event
        self._failed = False
        wall = Wall()
        self.session = LiveSession(setup, self._hear, record, wall, wall.wait, links, exercises)
        self.session.attach(self)

    def run(self) -> LiveSession:
        """Run the session to its end."""
        self.session.run()
        return self.session

    def of(self, kind: type[Any]) -> list[Any]:
        """Return the received events of one type."""
        return [event for event in self.events if isinstance(event, kind)]

    def _hear(self, event: SessionEvent, client: object | None) -> None:
        self.events.append(event)
        self._on_event(event)
        if isinstance(event, messages.State):
            posted = False
            while self._script and event.t_s >= self._script[0][0]:
                posted = self.session.post(self, self._script.pop(0)[1])
            failed_before, self._failed = self._failed, self.session.state == "failed"
            for_good = failed_before and self._failed and not posted
            if for_good or (event.t_s >= self._end_s and not self._script):
                self.session.stop()


def do(**entry: Any) -> messages.Do:
    """Return a command of a timeline entry; ``for_`` means ``for``."""
    return messages.Do({key.rstrip("_"): value for key, value in entry.items()})


def connected(address: Address, **options: Any) -> ClientConnection:
    """Open a WebSocket to a served session, as a program with its token."""
    return connect(address.socket, subprotocols=address.protocols, **options)  # type: ignore[arg-type]


class ButtonReader:
    """Firmware in Python that prints the level of a button at PA0."""

    def __init__(self, hal: VirtualHal) -> None:
        self._hal = hal

    def main(self) -> None:
        """Run the firmware's main function, as in C."""
        self._hal.HAL_GPIO_InitInput("A", 0, pull=1)
        while True:
            self._hal.HAL_Delay(20)
            self._hal.HAL_UART_Transmit(b"PA0 %d\n" % self._hal.HAL_GPIO_ReadPin("A", 0), 10)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """The timer is not used."""


class Reader:
    """Firmware in Python that reads both values of a hygrometer in one burst."""

    def __init__(self, hal: VirtualHal) -> None:
        self._hal = hal

    def main(self) -> None:
        """Run the firmware's main function, as in C."""
        self._hal.HAL_I2C_Mem_Write(0x5F << 1, 0x20, b"\x83")
        while True:
            self._hal.HAL_Delay(100)
            self._hal.HAL_I2C_Mem_Read(0x5F << 1, 0xA8, 4)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """The timer is not used."""
