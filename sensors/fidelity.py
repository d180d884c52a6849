"""How true a part's functions are, declared in the part's folder; the README's table is made of it.

Registers and bits without behaviour are not repeated here: the register maps say which they are.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Function:
    """One function of a part.

    ``source``: where it is documented; ``approximated``: how the model differs from silicon or fills a gap
    in the documents, empty where it does what they say; ``missing``: what the model leaves out.
    """

    name: str
    source: str
    approximated: str = ""
    missing: str = ""

    @property
    def verdict(self) -> str:
        """``modelled``, or what is approximated and what is not modelled."""
        parts = []
        if self.approximated:
            parts.append(f"approximated: {self.approximated}")
        if self.missing:
            parts.append(f"not modelled: {self.missing}")
        return "; ".join(parts) or "modelled"
