"""The systems that have wheels, and zig's names for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Target:
    """The wheel's platform, zig's target, and its name in ``sys.platform``."""

    tag: str
    triple: str
    system: str

    @property
    def flags(self) -> tuple[str, ...]:
        named = ("-Wl,-install_name,@rpath/libfcu.dylib",) if self.system == "darwin" else ()
        return "-target", self.triple, *named


VARIABLE: Final = "FCU_TARGET"
"""Environment variable that names the target of a build for another machine."""
TARGETS: Final = {
    target.tag.partition(".")[0]: target
    for target in (
        Target("manylinux2014_x86_64.manylinux_2_17_x86_64", "x86_64-linux-gnu.2.17", "linux"),
        Target("manylinux2014_aarch64.manylinux_2_17_aarch64", "aarch64-linux-gnu.2.17", "linux"),
        Target("musllinux_1_2_x86_64", "x86_64-linux-musl", "linux"),
        Target("musllinux_1_2_aarch64", "aarch64-linux-musl", "linux"),
        Target("macosx_11_0_x86_64", "x86_64-macos.11.0", "darwin"),
        Target("macosx_11_0_arm64", "aarch64-macos.11.0", "darwin"),
        Target("win_amd64", "x86_64-windows-gnu", "win32"),
        Target("win_arm64", "aarch64-windows-gnu", "win32"),
    )
}
"""Targets by the first platform name of their wheels."""
