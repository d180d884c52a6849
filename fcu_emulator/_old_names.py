"""The former package names: ``from emulator import Board`` works and gives a DeprecationWarning, for one release.

A user's own file or folder with such a name has precedence, as for every import. A module is the same object under
both names, so its classes are equal and old pickles can be read.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_loader
from types import CodeType, ModuleType

OLD = frozenset({"emulator", "sensors", "firmware_model", "scenarios"})
_NEW = "fcu_emulator."


def redirect(name: str) -> None:
    """In a clone, replace the module ``name`` of a top-level folder by the same part of fcu_emulator."""
    _warn(name, stacklevel=4)
    sys.modules[name] = import_module(_NEW + name)


class _Loader(Loader):
    """Load the module of fcu_emulator under its former name."""

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module of fcu_emulator."""
        module = import_module(_NEW + spec.name)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Restore the module's own spec, which importlib has replaced. The module is executed already."""
        module.__spec__ = (
            find_spec(module.__name__) if module.__spec__ is None else module.__spec__.loader_state
        )

    def get_code(self, name: str) -> CodeType | None:
        """Return the code, for ``python -m emulator``."""
        spec = find_spec(_NEW + name)
        loader = spec.loader if spec else None
        get_code = getattr(loader, "get_code", None)
        code: CodeType | None = get_code(_NEW + name) if get_code else None
        return code


class _Aliases(MetaPathFinder):
    """Find submodules of a former name, if that name is a part of fcu_emulator."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of the alias; None for a foreign module."""
        del path, target
        top, _, rest = name.partition(".")
        ours = rest and top in OLD and getattr(sys.modules.get(top), "__name__", "") == _NEW + top
        return spec_from_loader(name, _Loader()) if ours and find_spec(_NEW + name) else None


def old_spec(name: str) -> ModuleSpec | None:
    """Return the spec of a former top-level name that no other finder has found."""
    _warn(name, stacklevel=4)
    return spec_from_loader(name, _Loader(), is_package=True)


def _warn(name: str, stacklevel: int) -> None:
    new = "fcu_emulator" if name == "emulator" else _NEW + name
    warnings.warn(f"the package {name} is now {new}; import that", DeprecationWarning, stacklevel=stacklevel)


sys.meta_path.insert(0, _Aliases())
