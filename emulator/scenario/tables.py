"""What all tables of a scenario file have in common: strict types, unknown keys refused by name."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationInfo, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from emulator.world.limits import Range

MAX_FILE_BYTES = 1 << 20  # of a scenario or a text it names


class Table(BaseModel):
    """One table. Strict: no string becomes a number; NaN, infinity and unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        """The library's own message does not say which keys there are."""
        if not isinstance(data, dict):
            return data
        known = [field.alias or name for name, field in cls.model_fields.items()]
        for key in data:
            if key not in known:
                near = difflib.get_close_matches(str(key)[:40], known, n=1)
                hint = f"did you mean {near[0]}? " if near else ""
                problem = f"unknown key; {hint}known here: {', '.join(known)}"
                raise PydanticCustomError("unknown_key", "{problem}", {"key": str(key), "problem": problem})
        return data


def within(limits: Range) -> FieldInfo:
    """The world's own range of a quantity, so that file and world accept the same."""
    info: FieldInfo = Field(ge=limits.low, le=limits.high)
    return info


# TOML has arrays, not tuples: the outer type alone is taken leniently, its elements stay strict.
Vector = Annotated[tuple[float, float, float], Strict(False)]


def folder_of(info: ValidationInfo) -> Path:
    """The folder from which a file's relative paths count."""
    return Path((info.context or {}).get("folder", "."))


def read_bounded(path: Path, what: str) -> bytes:
    """A small regular file's bytes; ValueError says why it cannot be used."""
    try:
        if path.exists() and not path.is_file():  # a pipe or a terminal would keep us waiting
            raise ValueError(f"{path} is not a regular file; give {what}")
        with path.open("rb") as stream:
            data = stream.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror or error}; give {what}") from error
    if len(data) > MAX_FILE_BYTES:
        raise ValueError(f"{path} is larger than {MAX_FILE_BYTES >> 20} MiB; give {what}")
    return data
