"""Files and fields of a multipart request, straight to disk: memory holds a megabyte of them at most.

A file's own name is what people see and what says who walks ("07_01.amc"); a path is never made of it as it is.
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

from service.jobs.blobs import Blobs, Incoming
from service.problems import Problem

#: Suffixes of capture, and of the skeletons that AMC files need.
CAPTURE = (".amc", ".bvh", ".c3d", ".npz", ".trc")
SUFFIXES = (*CAPTURE, ".asf")
_FILES, _FIELDS = 500, 32  # at most
_FIELD_BYTES = 4096
_NAME = 80  # characters of a file's name that are kept
_BUFFER = 1 << 20
_MAGIC = {".npz": (0, b"PK", "a ZIP archive"), ".c3d": (1, b"\x50", "the second byte 0x50")}


@dataclass(frozen=True)
class Received:
    """A file that has come.

    Attributes:
        name: safe to be a file's name.
        sha: SHA-256.
        file: where it is until it is placed.
    """

    name: str
    sha: str
    file: Incoming


@dataclass
class Upload:
    """What a request brought.

    Attributes:
        fields: values by name.
        files: in the order of their coming.
    """

    fields: dict[str, str] = field(default_factory=dict)
    files: list[Received] = field(default_factory=list)


@asynccontextmanager
async def received(request: Request, blobs: Blobs) -> AsyncIterator[Upload]:
    """The fields and files of a multipart request; files that aren't placed within the block are removed.

    Args:
        request: whose body hasn't been read.
        blobs: receives the files.

    Raises:
        Problem: 400, no well-formed multipart body; 415, another kind of body; 422, a file of a kind that isn't read,
            an empty one, or too many.
        Full: the disk is full.
    """
    kind, options = parse_options_header(request.headers.get("content-type"))
    if kind != b"multipart/form-data":
        raise Problem(415, "the body must be multipart/form-data")
    blobs.check_room(int(request.headers.get("content-length", "0")))
    reader = _Reader(blobs, options.get(b"boundary", b""))
    try:
        yield await reader.read(request)
    finally:
        reader.discard()


class _Reader:
    """One body being read.

    Args:
        blobs: receives the files.
        boundary: between parts.
    """

    def __init__(self, blobs: Blobs, boundary: bytes):
        if not 0 < len(boundary) <= 70:  # RFC 2046, section 5.1.1
            raise Problem(400, "the content type names no boundary of 1 to 70 characters")
        events = self.events = []  # type: list[tuple[str, bytes]]
        data = lambda kind: lambda all_, start, end: events.append((kind, all_[start:end]))
        plain = lambda kind: lambda: events.append((kind, b""))
        self.parser = MultipartParser(boundary, {
            "on_header_field": data("header"), "on_header_value": data("value"), "on_header_end": plain("header end"),
            "on_headers_finished": plain("begin"), "on_part_data": data("data"), "on_part_end": plain("end"),
            "on_end": plain("all"),
        })  # fmt: skip
        self.blobs, self.upload, self.open = blobs, Upload(), []  # type: ignore[var-annotated]
        self.header, self.value, self.disposition = b"", b"", b""
        self.part: _File | _Field | None = None
        self.whole = False

    async def read(self, request: Request) -> Upload:
        """All of it."""
        try:
            async for chunk in request.stream():
                self.parser.write(chunk)
                for kind, data in self.events:
                    await self._take(kind, data)
                self.events.clear()
        except MultipartParseError as error:
            raise Problem(400, f"the body is no multipart/form-data: {error}") from None
        except ClientDisconnect:
            raise Problem(400, "the client went away") from None
        if not self.whole:
            raise Problem(400, "the body ends before its last boundary")
        return self.upload

    def discard(self) -> None:
        """Remove what hasn't been placed."""
        for file in self.open:
            file.discard()

    async def _take(self, kind: str, data: bytes) -> None:
        """One event of the parser."""
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
        """The part that begins after its headers."""
        _, options = parse_options_header(self.disposition)
        self.disposition = b""
        name = options.get(b"name", b"").decode("utf-8", "replace")
        if b"filename" in options or name == "files":
            if name != "files":
                raise Problem(422, "files must come in the field 'files'", field="/files")
            if len(self.upload.files) >= _FILES:
                raise Problem(422, f"{_FILES} files at most", field="/files", bound={"max_length": _FILES})
            safe = safe_name(options.get(b"filename", b"").decode("utf-8", "replace"))
            if any(file.name.lower() == safe.lower() for file in self.upload.files):
                raise Problem(422, f"two files are called {safe}: give each a name of its own", field="/files")
            self.open.append(self.blobs.receive())
            return _File(self.blobs, self.open[-1], safe)
        if len(self.upload.fields) >= _FIELDS or name in self.upload.fields:
            raise Problem(422, f"each field once, and {_FIELDS} at most")
        return _Field(name)


class _Field:
    """A field that is coming."""

    def __init__(self, name: str):
        self.name, self.value = name, b""

    async def add(self, data: bytes) -> None:
        """More of it."""
        self.value += data
        if len(self.value) > _FIELD_BYTES:
            raise Problem(422, f"a field must be of {_FIELD_BYTES} bytes at most", bound={"max_length": _FIELD_BYTES})

    async def end(self, upload: Upload) -> None:
        """That was all."""
        try:
            upload.fields[self.name] = self.value.decode()
        except UnicodeDecodeError:
            raise Problem(422, "fields must be text in UTF-8") from None


class _File:
    """A file that is coming."""

    def __init__(self, blobs: Blobs, file: Incoming, name: str):
        self.blobs, self.file, self.name = blobs, file, name
        self.buffer = bytearray()

    async def add(self, data: bytes) -> None:
        """More of it."""
        if not self.file.size and not self.buffer:
            self._begin(data)
        self.buffer += data
        if len(self.buffer) >= _BUFFER:
            await self._flush()

    async def end(self, upload: Upload) -> None:
        """That was all."""
        await self._flush()
        if not self.file.size:
            raise Problem(422, f"{self.name} is empty", field="/files")
        upload.files.append(Received(self.name, await asyncio.to_thread(self.file.close), self.file))

    def _begin(self, data: bytes) -> None:
        """Refuse at once what its first bytes give away."""
        place, magic, what = _MAGIC.get(self.name[-4:], (0, b"", ""))
        if len(data) > place and not data.startswith(magic, place):
            raise Problem(422, f"{self.name} isn't what its suffix says: such a file has {what}", field="/files")

    async def _flush(self) -> None:
        self.blobs.check_room(len(self.buffer))
        await asyncio.to_thread(self.file.write, bytes(self.buffer))
        self.buffer.clear()


def safe_name(name: str) -> str:
    """A plain file name for an upload called `name`: letters, digits, _ and -, and a suffix that is read.

    Args:
        name: as the client says it.

    Raises:
        Problem: 422, a suffix that isn't read.
    """
    base = re.split(r"[\\/]", name)[-1]
    stem, dot, suffix = base.rpartition(".")
    suffix = (dot + suffix).lower()
    if suffix not in SUFFIXES:
        raise Problem(
            422, f"each file needs a name that ends in {', '.join(SUFFIXES)}", field="/files",
            bound={"expected": " ".join(SUFFIXES)},
        )  # fmt: skip
    plain = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    return (re.sub(r"[^A-Za-z0-9_]+", "-", plain)[:_NAME].strip("-") or "capture") + suffix


def as_fields(schema: dict[str, Any], few: bool) -> dict[str, Any]:
    """OpenAPI of a multipart body.

    Args:
        schema: of its fields.
        few: whether one capture file is all.
    """
    files = {
        "type": "array", "minItems": 1, "maxItems": 2 if few else _FILES,
        "items": {"type": "string", "format": "binary"},
        "description": f"Files called *{', *'.join(SUFFIXES)}; AMC files with the ASF file of their skeleton.",
    }  # fmt: skip
    whole = {**schema, "properties": {**schema.get("properties", {}), "files": files}}
    whole["required"] = [*schema.get("required", []), "files"]
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": whole}}}}
