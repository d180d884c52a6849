"""Options of a command as fields of a dataclass. The command's function receives the dataclass.

::

    @dataclass(frozen=True, kw_only=True)
    class PlotOptions:
        output: Path | None = option("-o", "--output", type=PATH, help="...")

    @cli.command()
    @reads(PlotOptions)
    def plot(options: PlotOptions) -> None: ...
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import MISSING, field, fields
from typing import Any, TypeVar

import click

from fcu_emulator.emulator.cli.screen import say

_Options = TypeVar("_Options")
_Result = TypeVar("_Result")


class _Option(click.Option):
    def __init__(self, *names: Any, renamed_from: str | None = None, **settings: Any) -> None:
        super().__init__(*names, **settings)
        self.renamed_from = renamed_from


def option(*names: str, **settings: Any) -> Any:
    """Return a field for :func:`click.option`. ``renamed_from``: old name, which causes a warning."""
    default = settings.get("default", _absent(settings))
    declare = functools.partial(click.option, *names, cls=_Option, **settings)
    return field(default=MISSING if settings.get("required") else default, metadata={"declare": declare})


def argument(**settings: Any) -> Any:
    """Return a field for :func:`click.argument`."""
    optional = "default" in settings or settings.get("required") is False
    declare = functools.partial(click.argument, **settings)
    default = settings.get("default") if optional else MISSING
    return field(default=default, metadata={"declare": declare})


def _absent(settings: dict[str, Any]) -> Any:
    if settings.get("is_flag"):
        return False
    if settings.get("count"):
        return 0
    return () if settings.get("multiple") else None


def reads(options: type[_Options]) -> Callable[[Callable[[_Options], _Result]], Callable[..., _Result]]:
    """Pass a command's arguments as one object of ``options``."""

    def decorate(function: Callable[[_Options], _Result]) -> Callable[..., _Result]:
        @functools.wraps(function)
        def command(**typed: Any) -> _Result:
            return function(options(**typed))

        decorated: Callable[..., _Result] = command
        for one in reversed(fields(options)):  # type: ignore[arg-type]  # a dataclass
            decorated = one.metadata["declare"](one.name)(decorated)
        return decorated

    return decorate


class Command(click.Command):
    """A command that accepts old option names with a warning."""

    def renamed_options(self) -> dict[str, str]:
        """Return the current option name for each old name."""
        options = (one for one in self.params if isinstance(one, _Option))
        return {one.renamed_from: one.opts[0] for one in options if one.renamed_from is not None}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        renamed = self.renamed_options()
        for number, word in enumerate(args):
            if word == "--":
                break
            name, equals, value = word.partition("=")
            if name in renamed:
                say(f"warning: {name} is now called {renamed[name]}; use that name", "warning")
                args[number] = f"{renamed[name]}{equals}{value}"
        return super().parse_args(ctx, args)
