"""What went wrong on the bus as the operating system's error, which is what drivers catch."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from emulator.errors import I2CError, I2CNackError, I2CStuckError

# The error of an address nobody acknowledges: CircuitPython's and MicroPython's, and Linux' (i2c-bcm2835,
# Raspberry Pi). The latter by number, since Python knows its name on Linux only.
ENODEV: Final = errno.ENODEV
EREMOTEIO: Final = 121


@contextmanager
def os_errors(not_acknowledged: int) -> Iterator[None]:
    """Turn an I2CError into OSError: ``not_acknowledged`` (an errno), ETIMEDOUT for a stuck bus, or EIO."""
    try:
        yield
    except I2CNackError as error:
        raise OSError(not_acknowledged, str(error)) from error
    except I2CStuckError as error:
        raise OSError(errno.ETIMEDOUT, str(error)) from error
    except I2CError as error:
        raise OSError(errno.EIO, str(error)) from error
