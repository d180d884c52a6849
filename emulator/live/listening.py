"""The page's network address: the loopback address, or an address that the user gives.

Decision: the page is served on one address of this machine, so that a request's Host header can be
checked against DNS rebinding.
"""

from __future__ import annotations

import ipaddress

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.text import shown

LOCAL = "127.0.0.1"


def checked(listen: str) -> str:
    """Return an address in normal form. Raises InputError unless it is a single address."""
    try:
        address = ipaddress.ip_address(listen)
    except ValueError as error:
        raise InputError(
            f"--listen must be an IP address of this machine, not {shown(listen)}", kind="address"
        ) from error
    if address.is_unspecified or address.is_multicast:
        raise InputError(
            f"--listen must be one address of this machine, such as 192.168.1.20, not {address}",
            kind="address",
        )
    if address.version == 6 and address.is_link_local:
        raise InputError(
            f"--listen must be an address that a browser can open, not {address}", kind="address"
        )
    return str(address)


def host(listen: str) -> str:
    """Return an address for a URL, with IPv6 in brackets."""
    return f"[{listen}]" if ":" in listen else listen


def hosts(listen: str, port: int) -> tuple[str, ...]:
    """Return the valid Host headers of a request."""
    names = (LOCAL, "localhost") if listen == LOCAL else (host(listen),)
    return tuple(f"{name}:{port}" for name in names)


def warning(listen: str) -> str:
    """Return a warning if other machines can reach the page, otherwise ""."""
    if ipaddress.ip_address(listen).is_loopback:
        return ""
    return (
        f"warning: machines that reach {listen} can open the page with its address, which is not encrypted; "
        "use a network that you trust"
    )
