"""The LSM6DSL's basic interrupts: free fall, wake-up, orientation, tap and inactivity (AN5040 section 5)."""

from sensors.lsm6dsl.events.events import Events

__all__ = ["Events"]
