"""Find the packages by their former names, for one release. PYTEST_DONT_REWRITE

Python loads this file at every start, and :mod:`fcu_emulator._old_names` only when it is needed.
"""

import sys


class OldNames:
    """The last finder in sys.meta_path, for former names."""

    @staticmethod
    def find_spec(name, *_):  # type: ignore[no-untyped-def]
        """Return the spec for one of the former names."""
        if name not in ("emulator", "sensors", "firmware_model", "scenarios"):
            return None
        from fcu_emulator._old_names import old_spec

        return old_spec(name)


sys.meta_path.append(OldNames)  # type: ignore[arg-type]
