"""The build hook: compile the C library into the wheel, or in place for pip install -e."""

from __future__ import annotations

import os
import runpy
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags

sys.path.insert(0, str(Path(__file__).parent))  # needed, because hatchling loads the hook by its path

import library
import namespace
import targets

_GENERATED = "emulator/chip/native/generated"
_COMMIT = runpy.run_path(str(library.ROOT / "emulator" / "host" / "commit.py"))


class CustomBuildHook(BuildHookInterface[Any]):
    """Build hook that uses building/library.py, and building/targets.py for other systems."""

    def dependencies(self) -> list[str]:
        """Return zig as a build dependency for other systems, or if no C compiler works."""
        if self.target_name == "sdist":
            return []
        return [library.ZIG] if _target() or self._tried(library.own_compiler) is None else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the library; ``version`` is "editable" for pip install -e."""
        if self.target_name == "sdist":
            self._folder = Path(tempfile.mkdtemp())
            self._tried(lambda: library.write_headers(self._folder))
            for path in self._folder.iterdir():
                build_data["force_include"][str(path)] = f"{_GENERATED}/{path.name}"
            self._stamp(build_data, "")
            return
        if version == "editable":
            self.app.display_info(self._tried(library.build_in_place))
            return
        build_data["force_include"].update(namespace.wheel_files())
        self._folder = Path(tempfile.mkdtemp())
        for cache in ("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"):
            os.environ.setdefault(
                cache, str(self._folder / "zig")
            )  # otherwise zig leaves 60 MB in the user's folder
        target = _target()
        compiler = self._tried(
            lambda: library.zig(target.system, *target.flags) if target else library.compiler()
        )
        name = library.NATIVE["library_name"](compiler.system)
        self._tried(lambda: library.build(self._folder / name, compiler))
        build_data["force_include"][str(self._folder / name)] = f"fcu_emulator/emulator/chip/native/{name}"
        self._stamp(build_data, "fcu_emulator/")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{target.tag if target else _platform()}"

    def finalize(self, version: str, *_: Any) -> None:
        if version != "editable":
            shutil.rmtree(self._folder)

    def _stamp(self, build_data: dict[str, Any], place: str) -> None:
        """Add the file with the commit, if the commit is known."""
        commit = _COMMIT["commit"](library.ROOT) or _COMMIT["stamped"](library.ROOT)
        if commit:
            folder = Path(tempfile.mkdtemp(dir=self._folder))
            file = folder / _COMMIT["FILE"]
            file.write_text(f"{commit}\n", encoding="ascii")
            build_data["force_include"][str(file)] = place + file.name

    def _tried(self, make: Any) -> Any:
        try:
            return make()
        except library.BuildError as problem:
            self.app.abort(str(problem))


def _target() -> targets.Target | None:
    name = os.environ.get(targets.VARIABLE)
    return targets.TARGETS[name] if name else None


def _compiler() -> library.Compiler:
    target = _target()
    return library.zig(target.system, *target.flags) if target else library.compiler()


def _platform() -> str:
    """Return this machine's tag without a Linux baseline, because the baseline is unknown here."""
    return next(tag for tag in platform_tags() if "manylinux" not in tag and "musllinux" not in tag)
