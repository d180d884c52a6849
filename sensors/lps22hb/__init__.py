"""LPS22HB: pressure sensor."""

from sensors.lps22hb.declaration import LPS22HBErrors
from sensors.lps22hb.model import LPS22HB

__all__ = ["LPS22HB", "LPS22HBErrors"]
