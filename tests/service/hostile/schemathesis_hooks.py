"""Hooks of schemathesis: what files hold, answers that aren't text, and every format of motion asked for in turn."""

import io
import itertools
import zipfile

import numpy as np
import schemathesis
from hypothesis import strategies as st

from service.formats import BVH, CSV, FILES, FILMS, JSON, NPY, NPZ, PNG

FORMATS = (JSON, NPY, NPZ, CSV, BVH, PNG, "model/gltf-binary", "application/x-c3d", "text/x-trc", "text/x-mot")
_turn = itertools.cycle(FORMATS)
_HEADS = (b"", b"PK\x03\x04", b"\x02\x50", b"HIERARCHY\nROOT r {", b"PathFileType 4", b":FULLY-SPECIFIED\n1\n")

schemathesis.openapi.format("binary", st.tuples(st.sampled_from(_HEADS), st.binary(max_size=500)).map(b"".join))


@schemathesis.deserializer(NPZ, NPY, BVH, CSV, *FILES, *FILMS)
def read(ctx, response):
    """Bytes that begin as their format does, as the schema knows them: text."""
    kind = response.headers["content-type"][0].partition(";")[0]
    if kind == NPZ:
        with zipfile.ZipFile(io.BytesIO(response.content)) as archive:
            assert archive.testzip() is None
    elif kind == NPY:
        assert np.load(io.BytesIO(response.content), allow_pickle=False).ndim == 2
    return response.content.decode("latin1")


@schemathesis.hook
def before_call(ctx, case, kwargs):
    """Ask for each format in turn, and for no pictures that take long."""
    if case.method == "POST" and case.path.endswith("/synthesis"):
        case.headers["Accept"] = next(_turn)
