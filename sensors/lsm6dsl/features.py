"""All functions of the LSM6DSL beyond plain measuring, in the order in which they work."""

from __future__ import annotations

from collections.abc import Callable

from sensors.lsm6dsl.boot import Boot
from sensors.lsm6dsl.data_ready import DataReadySignals
from sensors.lsm6dsl.den import DataEnable
from sensors.lsm6dsl.embedded import EmbeddedFunctions
from sensors.lsm6dsl.event_samples import EventSamples
from sensors.lsm6dsl.events import Events
from sensors.lsm6dsl.feature import Chip, Feature
from sensors.lsm6dsl.fifo import Fifo
from sensors.lsm6dsl.function_sources import FunctionSources
from sensors.lsm6dsl.hub import SensorHub
from sensors.lsm6dsl.pins import Routing
from sensors.lsm6dsl.rounding import Rounding
from sensors.lsm6dsl.timestamp import Timestamp
from sensors.register import Register
from sensors.sampling import NEVER_PS


class Features:
    """Builds the features and speaks to all of them; those the part itself speaks to have a name."""

    def __init__(
        self,
        chip: Chip,
        samples: EventSamples,
        rate_changed: Callable[[int], None],
        stream_changed: Callable[[], None],
    ) -> None:
        self.events = Events(chip, samples, rate_changed)
        self.data_enable = DataEnable(chip, stream_changed)
        self.boot = Boot(chip.signals)
        sources, timestamp = FunctionSources(chip), Timestamp(chip)
        self.hub = SensorHub(chip, sources)
        # In the order in which they depend on each other's results: the events come first because they may
        # change the rates, pulses end after all events, and the pins come last.
        self._all: tuple[Feature, ...] = (
            self.events,
            self.data_enable,
            Rounding(chip),
            timestamp,
            EmbeddedFunctions(chip, sources),
            self.hub,
            Fifo(chip, timestamp),
            sources,
            DataReadySignals(chip),
            self.boot,
            Routing(chip),
        )

    def configuration(self) -> set[type[Register]]:
        """The registers whose writing may change what a feature does."""
        return {register for feature in self._all for register in feature.CONFIGURATION}

    def configure(self, now_ps: int, because_of: type[Register] | None = None) -> None:
        """The registers may have changed, or only the one named."""
        for feature in self._all:
            if because_of is None or because_of in feature.CONFIGURATION:
                feature.configure(now_ps)

    def catch_up(self, now_ps: int) -> None:
        """Let every active feature do what has become due."""
        for feature in self._all:
            if feature.active:
                feature.catch_up(now_ps)

    def catch_up_with_events(self, at_ps: int) -> None:
        """Likewise, called by the events, which have come so far already."""
        for feature in self._all:
            if feature.active and feature is not self.events:
                feature.catch_up(at_ps)

    def reset(self, now_ps: int) -> None:
        """SW_RESET."""
        for feature in self._all:
            feature.reset(now_ps)

    def next_event_ps(self) -> int:
        """When a pin may change next."""
        return min((feature.next_event_ps() for feature in self._all if feature.active), default=NEVER_PS)
