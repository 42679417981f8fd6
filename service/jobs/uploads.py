"""Multipart uploads, which Starlette keeps in temporary files, checked and moved into the store of files.

A file's name is shown to people and identifies the walker ("07_01.amc"); paths use a sanitised form of it.
"""

import asyncio
import re
import unicodedata
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from starlette.datastructures import FormData, UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.requests import ClientDisconnect, Request

import motionenv
from service.errors import Problem
from service.jobs.file_store import FileStore, Incoming
from service.jobs.store import full_disk_errors

#: Suffixes of capture, and of the skeletons that AMC files need.
CAPTURE = tuple(sorted(motionenv.mocap.SUFFIXES))
SUFFIXES = (*CAPTURE, ".asf")
_FILES, _FIELDS = 500, 32  # at most
_FIELD_BYTES = 1 << 15  # a marker map takes a few thousand
_NAME, _NAME_BYTES = 80, 200  # of a file's name that are kept; file systems allow 255 bytes
_BLOCK = 1 << 20
_MAGIC = {".npz": (0, b"PK", "a ZIP archive"), ".c3d": (1, b"\x50", "the second byte 0x50")}


@dataclass(frozen=True)
class Received:
    """A received file."""

    name: str  # sanitised
    sha: str  # SHA-256
    file: Incoming  # its temporary file


@dataclass
class Upload:
    """Fields and files of a request."""

    fields: dict[str, str] = field(default_factory=dict)  # values by name
    files: list[Received] = field(default_factory=list)  # in order of arrival


@asynccontextmanager
async def received(request: Request, file_store: FileStore) -> AsyncIterator[Upload]:
    """The fields and files of a multipart request; files that aren't placed within the block are removed.

    Raises:
        Problem: 400, malformed, or too many files or fields; 415, not multipart; 422, a file of an unknown format, an
            empty one, or two of one name.
        Full: the disk is full.
    """
    if not request.headers.get("content-type", "").lower().startswith("multipart/form-data"):
        raise Problem(415, "the body must be multipart/form-data")
    file_store.check_room(int(request.headers.get("content-length", "0")))
    form, upload, opened = await _form(request), Upload(), list[Incoming]()
    try:
        for name, value in form.multi_items():
            if isinstance(value, str) and name != "files" and name not in upload.fields:
                upload.fields[name] = value
            elif isinstance(value, UploadFile) and name == "files":
                upload.files.append(await asyncio.to_thread(_stored, value, upload, file_store, opened))
            else:
                problem = "files must come in the field 'files', and other fields once, as text"
                raise Problem(422, problem, field="/files")
        yield upload
    finally:
        await form.close()
        for file in opened:
            file.discard()


class _Parser(MultiPartParser):
    """Starlette's parser, which also tells whether the final boundary arrived: a file could be cut off without it."""

    whole = False

    def on_end(self) -> None:
        self.whole = True


async def _form(request: Request) -> FormData:
    limits = {"max_files": _FILES, "max_fields": _FIELDS, "max_part_size": _FIELD_BYTES}
    parser = _Parser(request.headers, request.stream(), **limits)
    try:
        with full_disk_errors():
            form = await parser.parse()
    except ClientDisconnect:
        raise Problem(400, "the client disconnected") from None
    except MultiPartException:
        told = f"at most {_FILES} files, {_FIELDS} fields and {_FIELD_BYTES} bytes in a field"
        raise Problem(400, f"the body must be multipart/form-data with {told}") from None
    if not parser.whole:
        await form.close()
        raise Problem(400, "the body ends before its final boundary: send it again")
    return form


def _stored(sent: UploadFile, upload: Upload, file_store: FileStore, opened: list[Incoming]) -> Received:
    name = safe_name(sent.filename or "")
    if any(file.name.casefold() == name.casefold() for file in upload.files):
        raise Problem(422, f"two files are named {name}: give each a different name", field="/files")
    opened.append(file := file_store.receive())
    place, magic, what = _MAGIC.get(name[-4:], (0, b"", ""))
    while block := sent.file.read(_BLOCK):
        if not file.size and len(block) > place and not block.startswith(magic, place):
            raise Problem(422, f"{name} doesn't match its suffix: such a file has {what}", field="/files")
        file_store.check_room(len(block))
        file.write(block)
    if not file.size:
        raise Problem(422, f"{name} is empty", field="/files")
    return Received(name, file.close(), file)


def safe_name(name: str) -> str:
    """A sanitised file name: letters and digits of any alphabet, _ and -, and a known suffix, or else 422.

    Letters are composed (NFC), so that a name is the same from every operating system.
    """
    base = re.split(r"[\\/]", name)[-1]
    stem, dot, suffix = base.rpartition(".")
    suffix = (dot + suffix).lower()
    if suffix not in SUFFIXES:
        raise Problem(
            422, f"file names must end in one of {', '.join(SUFFIXES)}", field="/files",
            bound={"expected": " ".join(SUFFIXES)},
        )  # fmt: skip
    composed = unicodedata.normalize("NFC", stem)
    letter = lambda c: c == "_" or unicodedata.category(c)[0] in "LMN"  # or a mark upon one, as Hindi's vowels; a digit
    plain = re.sub("-+", "-", "".join(c if letter(c) else "-" for c in composed)).lstrip("-")
    short = plain[:_NAME].encode()[:_NAME_BYTES].decode(errors="ignore")
    return (unicodedata.normalize("NFC", short).strip("-") or "capture") + suffix


def as_fields(schema: dict[str, Any], few: bool) -> dict[str, Any]:
    """OpenAPI of a multipart body with fields of a schema, and with `few` only one capture file."""
    files = {
        "type": "array", "minItems": 1, "maxItems": 2 if few else _FILES,
        "items": {"type": "string", "format": "binary"},
        "description": f"Files named *{', *'.join(SUFFIXES)}; AMC files need the ASF file of their skeleton.",
    }  # fmt: skip
    whole = {**schema, "properties": {**schema.get("properties", {}), "files": files}}
    whole["required"] = [*schema.get("required", []), "files"]
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": whole}}}}
