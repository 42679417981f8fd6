"""Multipart uploads, streamed to disk through at most a megabyte of memory.

A file's name is shown to people and identifies the walker ("07_01.amc"); paths use a sanitised form of it.
"""

import asyncio
import re
import unicodedata
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

from fastapi import Request
from python_multipart.exceptions import MultipartParseError
from python_multipart.multipart import MultipartParser, parse_options_header
from starlette.requests import ClientDisconnect

from service.errors import Problem
from service.jobs.file_store import FileStore, Incoming

#: Suffixes of capture, and of the skeletons that AMC files need.
CAPTURE = (".amc", ".bvh", ".c3d", ".npz", ".trc")
SUFFIXES = (*CAPTURE, ".asf")
_FILES, _FIELDS = 500, 32  # at most
_FIELD_BYTES = 1 << 15  # a marker map takes a few thousand
_NAME, _NAME_BYTES = 80, 200  # of a file's name that are kept; file systems allow 255 bytes
_BUFFER = 1 << 20
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
        Problem: 400, malformed; 415, not multipart; 422, a file of an unknown format, an empty one, or too many.
        Full: the disk is full.
    """
    kind, options = parse_options_header(request.headers.get("content-type"))
    if kind != b"multipart/form-data":
        raise Problem(415, "the body must be multipart/form-data")
    file_store.check_room(int(request.headers.get("content-length", "0")))
    reader = _Reader(file_store, options.get(b"boundary", b""))
    try:
        yield await reader.read(request)
    finally:
        reader.discard()


class _Reader:
    def __init__(self, file_store: FileStore, boundary: bytes):
        if not 0 < len(boundary) <= 70:  # RFC 2046, section 5.1.1
            raise Problem(400, "Content-Type needs a boundary of 1 to 70 characters")
        events = self.events = []  # type: list[tuple[str, bytes]]
        data = lambda kind: lambda all_, start, end: events.append((kind, all_[start:end]))
        plain = lambda kind: lambda: events.append((kind, b""))
        self.parser = MultipartParser(boundary, {
            "on_header_field": data("header"), "on_header_value": data("value"), "on_header_end": plain("header end"),
            "on_headers_finished": plain("begin"), "on_part_data": data("data"), "on_part_end": plain("end"),
            "on_end": plain("all"),
        })  # fmt: skip
        self.file_store, self.upload, self.open = file_store, Upload(), []  # type: ignore[var-annotated]
        self.header, self.value, self.disposition = b"", b"", b""
        self.part: _File | _Field | None = None
        self.whole = False

    async def read(self, request: Request) -> Upload:
        try:
            async for chunk in request.stream():
                self.parser.write(chunk)
                for kind, data in self.events:
                    await self._take(kind, data)
                self.events.clear()
        except MultipartParseError:
            raise Problem(400, "the body is not valid multipart/form-data") from None
        except ClientDisconnect:
            raise Problem(400, "the client disconnected") from None
        if not self.whole:
            raise Problem(400, "the body ends before its final boundary")
        return self.upload

    def discard(self) -> None:
        for file in self.open:
            file.discard()

    async def _take(self, kind: str, data: bytes) -> None:
        if kind == "header":
            self.header += data
        elif kind == "value":
            self.value += data
        elif kind == "header end":
            if self.header.lower() == b"content-disposition":
                self.disposition = self.value
            self.header = self.value = b""
        elif kind == "begin":
            self.part = self._begun()
        elif kind == "all":
            self.whole = True
        elif self.part is not None:
            await (self.part.add(data) if kind == "data" else self.part.end(self.upload))

    def _begun(self) -> "_File | _Field":
        _, options = parse_options_header(self.disposition)
        self.disposition = b""
        name = options.get(b"name", b"").decode("utf-8", "replace")
        if b"filename" in options or name == "files":
            if name != "files":
                raise Problem(422, "files must come in the field 'files'", field="/files")
            if len(self.upload.files) >= _FILES:
                raise Problem(422, f"at most {_FILES} files are allowed", field="/files", bound={"max_length": _FILES})
            safe = safe_name(options.get(b"filename", b"").decode("utf-8", "replace"))
            if any(file.name.casefold() == safe.casefold() for file in self.upload.files):
                raise Problem(422, f"two files are named {safe}: give each a different name", field="/files")
            self.open.append(self.file_store.receive())
            return _File(self.file_store, self.open[-1], safe)
        if len(self.upload.fields) >= _FIELDS or name in self.upload.fields:
            raise Problem(422, f"each field is allowed once, and at most {_FIELDS} fields")
        return _Field(name)


class _Field:
    def __init__(self, name: str):
        self.name, self.value = name, b""

    async def add(self, data: bytes) -> None:
        self.value += data
        if len(self.value) > _FIELD_BYTES:
            raise Problem(422, f"a field must have at most {_FIELD_BYTES} bytes", bound={"max_length": _FIELD_BYTES})

    async def end(self, upload: Upload) -> None:
        try:
            upload.fields[self.name] = self.value.decode()
        except UnicodeDecodeError:
            raise Problem(422, "fields must be UTF-8 text") from None


class _File:
    def __init__(self, file_store: FileStore, file: Incoming, name: str):
        self.file_store, self.file, self.name = file_store, file, name
        self.buffer = bytearray()

    async def add(self, data: bytes) -> None:
        if not self.file.size and not self.buffer:
            self._begin(data)
        self.buffer += data
        if len(self.buffer) >= _BUFFER:
            await self._flush()

    async def end(self, upload: Upload) -> None:
        await self._flush()
        if not self.file.size:
            raise Problem(422, f"{self.name} is empty", field="/files")
        upload.files.append(Received(self.name, await asyncio.to_thread(self.file.close), self.file))

    def _begin(self, data: bytes) -> None:
        place, magic, what = _MAGIC.get(self.name[-4:], (0, b"", ""))
        if len(data) > place and not data.startswith(magic, place):
            raise Problem(422, f"{self.name} doesn't match its suffix: such a file has {what}", field="/files")

    async def _flush(self) -> None:
        self.file_store.check_room(len(self.buffer))
        await asyncio.to_thread(self.file.write, bytes(self.buffer))
        self.buffer.clear()


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
