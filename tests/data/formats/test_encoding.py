"""Encodings, tables, and the protocol of all formats."""

import inspect
import io
import time

import numpy as np
import pyarrow.parquet as parquet
import pytest
from PIL import Image

from motionenv.data import FORMATS
from motionenv.data.formats import format_of
from motionenv.data.formats.base import Format
from motionenv.data.formats.encoding import SUFFIX, Table, encoded, packed
from motionenv.errors import MotionError


@pytest.mark.parametrize("how", SUFFIX)
def test_encodings(how):
    rng = np.random.default_rng(0)
    picture = np.repeat(np.repeat(rng.integers(256, size=(8, 9, 3), dtype=np.uint8), 8, 0), 8, 1)
    content = encoded(picture, how)
    assert content == encoded(picture.copy(), how)
    opened = Image.open(io.BytesIO(content))
    assert opened.format.lower() == how
    off = np.abs(np.asarray(opened).astype(int) - picture)
    assert off.max() == 0 if how != "jpeg" else off.mean() < 4


def test_arrays_are_exact_and_tell_no_time(monkeypatch):
    depth = np.random.default_rng(0).normal(size=(30, 20)).astype(np.float32)
    first, now = packed(depth=depth), time.time()
    monkeypatch.setattr("time.time", lambda: now + 1e6)
    assert packed(depth=depth) == first
    assert np.array_equal(np.load(io.BytesIO(first))["depth"], depth)
    assert len(packed(depth=np.zeros((64, 64)))) < 1000


def test_rows_come_back_and_pictures_stay_out(tmp_path):
    table, rng = Table(), np.random.default_rng(1)
    samples = [
        {"rgb": np.zeros((2, 2, 3)), "joints": rng.normal(size=(3, 4, 2)), "index": np.array(k)} for k in range(5)
    ]
    samples[2]["joints"][0] = np.nan
    for sample in samples:
        table.add(sample, {"key": str(sample["index"])})
    for name in ("one", "two"):
        table.write(tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    read = parquet.read_table(tmp_path / "one")
    assert read.column_names == ["key", "joints", "index"]
    assert read["key"].to_pylist() == list("01234")
    np.testing.assert_array_equal(np.array(read["joints"].to_pylist()), [sample["joints"] for sample in samples])


@pytest.mark.parametrize("name", FORMATS)
def test_formats_have_the_methods_of_the_protocol(name):
    made = format_of(name)
    assert made.name == name
    for method in ("check", "write", "finish"):
        wanted, found = (inspect.signature(getattr(of, method)).parameters for of in (Format, type(made)))
        assert list(found) == list(wanted)


def test_unknown_formats():
    with pytest.raises(MotionError, match="format must be one of webdataset, coco.*, got 'csv'"):
        format_of("csv")
