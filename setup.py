"""The native engine, emulator/arm/native, as an extension module; all else is in pyproject.toml.

Here and not there because setuptools takes no patterns there: a list of files that lacks one makes a library
that does not load, and nobody would notice, because Unicorn takes its place.
"""

import runpy
import sysconfig
from pathlib import Path

from setuptools import Extension, setup

FOLDER = Path("emulator/arm/native")
digest = runpy.run_path(str(FOLDER / "__init__.py"))["digest"](FOLDER)

native = Extension(
    "emulator.arm.native._core",
    sources=sorted(path.as_posix() for path in FOLDER.glob("*.c")),
    depends=sorted(path.as_posix() for path in FOLDER.glob("*.h")),
    define_macros=[("SOURCES", f'"{digest}"')],
    extra_compile_args=[
        "-std=gnu11",
        "-O2",
        # Flags are written together and read one by one: out of a vector they come late. A fifth faster so.
        "-fno-tree-slp-vectorize",
        "-ffp-contract=off",  # a product and a sum are rounded one after the other, as on the chip
    ],
    libraries=["m"],
    py_limited_api=True,  # one library for all versions of Python from 3.11 on
    optional=True,  # the installation succeeds without gcc or clang, too; Unicorn then executes the firmware
)
# Python without its interpreter lock has no limited API: nothing is built for it, nor may the wheel claim it.
wheel = {} if sysconfig.get_config_var("Py_GIL_DISABLED") else {"py_limited_api": "cp311"}

setup(ext_modules=[native], options={"bdist_wheel": wheel})
