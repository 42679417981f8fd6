"""Frozen records that TOML and JSON files hold, and that say in plain words what is wrong with a file."""

import inspect
import json
import re
import tomllib
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from motionenv._core.validation import did_you_mean
from motionenv.errors import MotionError


def _describe(schema: dict[str, Any], record: type) -> None:
    """Give the properties of a JSON schema the words of the docstrings of the record and of what it derives from."""
    text = (inspect.getdoc(record) or "").partition("\n\nAttributes:\n")[0]
    schema["description"] = " ".join(text.split())
    attributes = "\n".join(
        part.partition("Attributes:\n")[2] for part in map(inspect.getdoc, record.__mro__[:-1]) if part
    )
    for names, words in re.findall(r"^    (\w[\w, ]*): (.*(?:\n {6,}.*)*)", attributes, re.MULTILINE):
        described = " ".join(words.split())
        for name in names.split(", "):
            if name in schema.get("properties", {}):
                schema["properties"][name].setdefault("description", described[0].upper() + described[1:])


class Record(BaseModel):
    """Base of what users write: no unknown fields, no NaN or infinity, nothing that changes.

    Attributes:
        noun: what errors call it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, json_schema_extra=_describe)
    noun: ClassVar[str] = "specification"

    @classmethod
    def of(cls, content: dict[str, Any]) -> Self:
        """The record of a `content` as a file holds it; a MotionError names a field that is wrong."""
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"] if not str(part).startswith(("function-", "tuple")))
            what = first["msg"].removeprefix("Value error, ")
            if first["type"] == "extra_forbidden":
                known = _field_names(cls.model_json_schema())
                what = "there is no such field" + did_you_mean(str(first["loc"][-1]), known)
            given = "" if isinstance(first["input"], dict) else f"; got {first['input']!r}"
            raise MotionError(f"{cls.noun}: {where or 'the whole'}: {what}{given}") from None


def read_content(source: str | Path, expected: str) -> dict[str, Any]:
    """The content of the TOML or JSON file `source`; a MotionError, with the words `expected` for another suffix."""
    path = Path(source)
    if path.suffix.lower() not in (".toml", ".json"):
        raise MotionError(f"{expected}; got {str(source)!r}")
    try:
        text = path.read_text("utf-8")
        return tomllib.loads(text) if path.suffix.lower() == ".toml" else json.loads(text)
    except OSError as error:
        raise MotionError(f"can't read {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise MotionError(f"{path} isn't {path.suffix[1:].upper()}: {error}") from None


def _field_names(schema: dict[str, Any]) -> set[str]:
    """Names of all fields, also of those within."""
    inner = schema.get("$defs", {}).values()
    return {name for part in (schema, *inner) for name in part.get("properties", {})}
