"""Both engines execute what tests of the core are about; all other tests use the one that is the default."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from emulator.arm.cpu import engines

_ON_BOTH = ("test_core_", "test_speed_", "test_gdb_target", "test_hostile_", "test_i2c_master")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """The tests of those modules are run once for each engine."""
    name = metafunc.module.__name__.rpartition(".")[2]
    if name.startswith(_ON_BOTH):
        metafunc.parametrize("engine_name", engines.CHOICES, indirect=True, scope="module")


@pytest.fixture(scope="module", autouse=True)
def engine_name(request: pytest.FixtureRequest) -> Iterator[str]:
    """The engine that is used unless a test asks for another; "" is the default."""
    name: str = getattr(request, "param", "")
    if name == engines.NATIVE and (missing := engines.why_not_native()):
        pytest.skip(f"the native engine {missing}")
    with pytest.MonkeyPatch.context() as patch:
        if name:
            patch.setenv(engines.VARIABLE, name)
        yield name
