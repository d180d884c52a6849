"""Find the former packages ``emulator``, ``sensors``, ``firmware_model`` and ``scenarios``, for one release.

Every start of Python loads this file, so it only adds a finder, which comes last and loads
:mod:`fcu_emulator._old_names` when one of the names is imported. PYTEST_DONT_REWRITE
"""

import sys


class OldNames:
    """The last finder in sys.meta_path."""

    @staticmethod
    def find_spec(name, *_):  # type: ignore[no-untyped-def]
        """Return the spec of a part of fcu_emulator for one of the four names."""
        if name not in ("emulator", "sensors", "firmware_model", "scenarios"):
            return None
        from fcu_emulator._old_names import old_spec

        return old_spec(name)


sys.meta_path.append(OldNames)  # type: ignore[arg-type]
