"""The eight timers of the chip: what each can do, where it is, which pins are its channels.

RM0368 sections 12 (TIM1), 13 (TIM2 to 5), 14 (TIM9 to 11), tables 1 and 38; pins from the STM32F401xB/C
datasheet's table of alternate functions.
"""

from __future__ import annotations

from dataclasses import dataclass

_UIF, _CC, _COM_TRG, _BRK = 0x01, 0x1E, 0x60, 0x80
_ALL = 0xFF


@dataclass(frozen=True)
class Variant:
    """One timer. ``irqs``: (flags of SR, interrupt number). ``pins``: by channel."""

    name: str
    base: int
    apb: int
    bits: int
    irqs: tuple[tuple[int, int], ...]
    alternate: int
    pins: tuple[tuple[tuple[str, int], ...], ...]
    up_only: bool = False
    advanced: bool = False

    @property
    def channels(self) -> int:
        """Number of capture/compare channels."""
        return len(self.pins)


VARIANTS = (
    Variant(
        "TIM1",
        0x4001_0000,
        2,
        16,
        ((_UIF, 25), (_CC, 27), (_COM_TRG, 26), (_BRK, 24)),
        1,
        ((("A", 8), ("E", 9)), (("A", 9), ("E", 11)), (("A", 10), ("E", 13)), (("A", 11), ("E", 14))),
        advanced=True,
    ),
    Variant(
        "TIM2",
        0x4000_0000,
        1,
        32,
        ((_ALL, 28),),
        1,
        ((("A", 0), ("A", 5), ("A", 15)), (("A", 1), ("B", 3)), (("A", 2), ("B", 10)), (("A", 3), ("B", 11))),
    ),
    Variant(
        "TIM3",
        0x4000_0400,
        1,
        16,
        ((_ALL, 29),),
        2,
        (
            (("A", 6), ("B", 4), ("C", 6)),
            (("A", 7), ("B", 5), ("C", 7)),
            (("B", 0), ("C", 8)),
            (("B", 1), ("C", 9)),
        ),
    ),
    Variant(
        "TIM4",
        0x4000_0800,
        1,
        16,
        ((_ALL, 30),),
        2,
        ((("B", 6), ("D", 12)), (("B", 7), ("D", 13)), (("B", 8), ("D", 14)), (("B", 9), ("D", 15))),
    ),
    Variant(
        "TIM5", 0x4000_0C00, 1, 32, ((_ALL, 50),), 2, ((("A", 0),), (("A", 1),), (("A", 2),), (("A", 3),))
    ),
    Variant(
        "TIM9",
        0x4001_4000,
        2,
        16,
        ((_ALL, 24),),
        3,
        ((("A", 2), ("E", 5)), (("A", 3), ("E", 6))),
        up_only=True,
    ),
    Variant("TIM10", 0x4001_4400, 2, 16, ((_ALL, 25),), 3, ((("B", 8),),), up_only=True),
    Variant("TIM11", 0x4001_4800, 2, 16, ((_ALL, 26),), 3, ((("B", 9),),), up_only=True),
)
