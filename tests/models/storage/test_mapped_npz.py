"""Mapped model files: aligned, opened at once, read-only, refused when damaged, and watched while in use."""

import json
import os
import pickle
import subprocess
import sys
import time
import zipfile
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import motionenv
from motionenv.errors import ModelError
from motionenv.models.storage import mapped_npz as mapped
from motionenv.models.storage import model_file as store

ARRAYS = {
    "poses": np.arange(300, dtype=np.float32).reshape(12, 25),
    "flags": np.array([True, False, True]),
    "nothing": np.empty((0, 3)),
    "padded": np.array([1.0, np.inf], dtype=np.float32),
    "number": np.array(7, dtype=np.int32),
}
ARRAYS_OF_NUMBERS = {"a": np.arange(6.0).reshape(2, 3)}
META = {"settings": {"splits": "sign"}, "card": {"people": 2}}


@pytest.fixture
def saved(tmp_path) -> Path:
    path = tmp_path / "tree.npz"
    store.save_model(path, "tree", ARRAYS, META, mapped=True)
    return path


def opened(path) -> SimpleNamespace:
    """Stands for a model: the arrays of a file with the `Mapping` that watches over it, as `store.load` leaves it."""
    _, arrays, _, mapping = store._opened(path)
    return SimpleNamespace(**arrays, mapping_=mapping)


def test_what_is_saved_is_mapped_aligned_and_read_only(saved):
    kind, arrays, meta = store.load_model(saved)
    assert (kind, meta) == ("tree", META)
    assert arrays.keys() == ARRAYS.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(array, ARRAYS[name], strict=True)
        assert array.ctypes.data % 64 == 0
        assert not array.flags.writeable
        assert not array.flags.owndata


def test_numpy_and_zip_tools_open_it(saved):
    with np.load(saved) as file:
        assert json.loads(str(file["header"]))["kind"] == "tree"
        for name, array in ARRAYS.items():
            np.testing.assert_array_equal(file[name], array, strict=True)
    with zipfile.ZipFile(saved) as archive:
        assert archive.testzip() is None
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}


def test_the_same_model_gives_the_same_bytes_also_from_mapped_arrays(saved, tmp_path):
    one, other = tmp_path / "one.npz", tmp_path / "other.npz"
    store.save_model(one, "fpca", ARRAYS_OF_NUMBERS, META)
    store.save_model(other, *store.load_model(one))
    assert one.read_bytes() == other.read_bytes()
    store.save_model(tmp_path / "again.npz", *store.load_model(saved), mapped=True)
    assert (tmp_path / "again.npz").read_bytes() == saved.read_bytes()
    store.save_model(saved, *store.load_model(saved), mapped=True)  # over the file that the arrays are mapped from
    assert (tmp_path / "again.npz").read_bytes() == saved.read_bytes()


def test_a_large_file_is_opened_and_written_without_a_copy(tmp_path):
    """More than the limit on what is unpacked, in a process of its own, whose memory is looked at."""
    program = """
import sys
import numpy as np
from motionenv.models.storage import model_file as store
big = np.lib.format.open_memmap(sys.argv[1], "w+", np.float32, (5 * 2**24, 1))
store.save_model(sys.argv[2], "tree", {"big": big, "small": np.arange(3)}, {}, mapped=True)
arrays = store.load_model(sys.argv[2])[1]
anonymous = next(int(l.split()[1]) for l in open("/proc/self/status") if l.startswith("RssAnon"))
print(anonymous / 1024, arrays["big"].shape[0])
"""
    environment = {**os.environ, "PYTHONPATH": str(Path(motionenv.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path / "big.npy", tmp_path / "big.npz"],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    megabytes, rows = map(float, done.stdout.split())
    assert rows == 5 * 2**24
    assert megabytes < 200
    (tmp_path / "big.npy").unlink()
    (tmp_path / "big.npz").unlink()


@pytest.mark.parametrize("mapped", [False, True])
def test_every_truncation_is_refused(tmp_path, mapped):
    path = tmp_path / "model.npz"
    store.save_model(path, "fpca", ARRAYS_OF_NUMBERS, META, mapped=mapped)
    data = path.read_bytes()
    for n in range(0, len(data), 7):
        path.write_bytes(data[:n])
        with pytest.raises(ModelError, match="damaged or not a model file"):
            store.load_model(path)


def test_flipped_bytes_never_escape_as_another_error_nor_reach_outside_the_file(saved):
    data = saved.read_bytes()
    for i in range(len(data)):
        saved.write_bytes(data[:i] + bytes([data[i] ^ 0x55]) + data[i + 1 :])
        try:
            _, arrays, _ = store.load_model(saved)
        except ModelError:
            continue
        assert sum(array.nbytes for array in arrays.values()) < len(data)
        assert [array.tobytes() for array in arrays.values()]


def test_a_tree_that_isnt_laid_out_to_be_mapped_is_refused(saved):
    with zipfile.ZipFile(saved) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for packing in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        with zipfile.ZipFile(saved, "w", packing) as archive:
            for name, data in members.items():
                archive.writestr(name, data)
        with pytest.raises(ModelError, match="damaged at array"):
            store.load_model(saved)


def test_what_cant_be_mapped_is_not_written(tmp_path):
    for array in (np.array([1.0, np.nan]), np.array(["x"])):
        for layout in (False, True):
            with pytest.raises(ModelError, match="finite"):
                store.save_model(tmp_path / "x.npz", "tree", {"a": array}, {}, mapped=layout)
    with pytest.raises(ModelError, match="contiguous"):
        store.save_model(tmp_path / "x.npz", "tree", {"a": np.zeros((3, 4)).T}, {}, mapped=True)
    assert not list(tmp_path.iterdir())


def test_missing_arrays_are_told(saved):
    with pytest.raises(ModelError, match="lacks data of a model of kind 'tree'"):
        motionenv.load(saved)


def test_a_file_that_is_replaced_goes_on_being_used(saved):
    model = opened(saved)
    store.save_model(saved, "tree", {"poses": np.zeros(3)}, {}, mapped=True)
    model.mapping_.check()
    np.testing.assert_array_equal(model.poses, ARRAYS["poses"])
    saved.unlink()
    model.mapping_.check()
    np.testing.assert_array_equal(model.poses, ARRAYS["poses"])


def test_a_file_that_is_changed_in_place_is_noticed(saved):
    data = saved.read_bytes()
    for change in (partial(os.truncate, saved, 100), partial(saved.write_bytes, data[::-1]), saved.touch):
        saved.write_bytes(data)
        mapping = opened(saved).mapping_
        mapping.check()
        time.sleep(0.02)  # the file system's clock ticks every few milliseconds
        change()
        with pytest.raises(ModelError, match=r"tree\.npz was changed while it was in use"):
            mapping.check()


def test_files_are_closed_when_their_models_are_gone(saved):
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        opened(saved).mapping_.check()
    assert len(os.listdir("/proc/self/fd")) <= before + 1


class Held:
    """A model as far as pickling goes."""

    def __init__(self, path):
        self.mapping_ = opened(path).mapping_

    def __reduce__(self):
        return self.mapping_.reduced(Held)


def test_a_pickle_holds_the_path_and_knows_its_file(saved, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pickled = pickle.dumps(Held("tree.npz"))
    assert len(pickled) < 500
    monkeypatch.chdir("/")
    assert pickle.loads(pickled).mapping_.path == saved
    mapped.write_mapped(saved, {"header": np.array(json.dumps(store._header("", zipfile.ZipFile(saved)))), **ARRAYS})
    assert pickle.loads(pickled).mapping_.path == saved  # the same content
    store.save_model(saved, "tree", {"poses": np.zeros(3)}, {}, mapped=True)
    with pytest.raises(ModelError, match="has changed since this model was pickled"):
        pickle.loads(pickled)
    saved.unlink()
    with pytest.raises(ModelError, match="no model file"):
        pickle.loads(pickled)
