"""A folder of wheels that replaces a package index. It contains installed packages, so tests need no network."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path
from zipfile import ZipFile

from packaging.requirements import Requirement


def pack(name: str, folder: Path) -> Path:
    """Pack an installed package into a wheel, without its programs."""
    package = distribution(name)
    assert package.files is not None
    files = [file for file in package.files if ".." not in file.parts and "__pycache__" not in file.parts]
    left_out = {"RECORD", "direct_url.json", "INSTALLER", "REQUESTED"}
    contents = {
        str(file.as_posix()): Path(str(file.locate())).read_bytes()
        for file in files
        if file.name not in left_out or not file.parts[0].endswith(".dist-info")
    }
    (information,) = {path.partition("/")[0] for path in contents if path.endswith(".dist-info/WHEEL")}
    record = [f"{path},{_digest(data)},{len(data)}" for path, data in contents.items()]
    contents[f"{information}/RECORD"] = "\n".join([*record, f"{information}/RECORD,,", ""]).encode()
    wheel = folder / f"{information.removesuffix('.dist-info')}-{_tag(package)}.whl"
    with ZipFile(wheel, "w") as archive:
        for path, data in contents.items():
            archive.writestr(path, data)
    return wheel


def needed_by(name: str) -> Iterator[str]:
    """Yield the packages that an installed package needs in this environment, directly or not, without extras."""
    seen, waiting = {name}, [name]
    while waiting:
        for text in distribution(waiting.pop()).requires or ():
            requirement = Requirement(text)
            if requirement.name not in seen and (
                requirement.marker is None or requirement.marker.evaluate({"extra": ""})
            ):
                seen.add(requirement.name)
                waiting.append(requirement.name)
                yield requirement.name


def _digest(data: bytes) -> str:
    return "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")


def _tag(package: Distribution) -> str:
    """Return the compressed tag of the wheel from which a package was installed, such as py2.py3-none-any."""
    tags = [line.removeprefix("Tag: ") for line in (package.read_text("WHEEL") or "").splitlines()]
    parts = [tag.split("-") for tag in tags if tag.count("-") == 2 and ":" not in tag]
    return "-".join(".".join(dict.fromkeys(column)) for column in zip(*parts, strict=True))
