"""The model file: same bytes for the same model, and a clear refusal of everything else."""

import io
import json
import zipfile

import numpy as np
import pytest

from motionenv.errors import ModelError
from motionenv.models import registry
from motionenv.models.storage import model_file as store


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "model.npz"
    store.save_model(path, "fpca", {"a": np.arange(6.0).reshape(2, 3)}, {"settings": {"x": 1}, "card": {"people": 3}})
    return path


def rewrite(path, **members):
    """The same zip with members (npy bytes) replaced."""
    with zipfile.ZipFile(path) as archive:
        old = {n: archive.read(n) for n in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in {**old, **{f"{k}.npy": v for k, v in members.items()}}.items():
            archive.writestr(name, data)


def npy(array, **kwargs) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, **kwargs)
    return stream.getvalue()


def header(**changes) -> bytes:
    fields = {"format": store.FORMAT, "format_version": 1, "motionenv": "9", "kind": "fpca", "meta": {}} | changes
    return npy(np.array(json.dumps(fields)))


def test_what_is_saved_is_loaded(saved):
    kind, arrays, meta = store.load_model(saved)
    assert kind == "fpca"
    assert meta == {"settings": {"x": 1}, "card": {"people": 3}}
    np.testing.assert_array_equal(arrays["a"], np.arange(6.0).reshape(2, 3))


def test_flipped_bytes_never_escape_as_another_error(saved):
    data = saved.read_bytes()
    for i in range(len(data)):
        saved.write_bytes(data[:i] + bytes([data[i] ^ 0x55]) + data[i + 1 :])
        try:
            store.load_model(saved)
        except ModelError:
            continue


@pytest.mark.parametrize(
    ("member", "says"),
    [
        ({"header": header(format_version=2)}, "install that version"),
        ({"header": header(format="other")}, "not a motionenv model"),
        ({"header": header(kind=7)}, "damaged header"),
        ({"header": npy(np.array("{"))}, "damaged or not a model file"),
        ({"a": npy(np.array([1.0, np.nan]))}, "finite"),
        ({"a": npy(np.array([{}], dtype=object), allow_pickle=True)}, "damaged or not a model file"),
        ({"a": npy(np.array(["x"]))}, "finite"),
        ({"a": b"text"}, "damaged or not a model file"),
    ],
)
def test_foreign_contents_are_refused(saved, member, says):
    rewrite(saved, **member)
    with pytest.raises(ModelError, match=says):
        store.load_model(saved)


def test_large_models_are_not_compressed_and_may_hold_infinities(tmp_path):
    arrays = {"padded": np.array([1.0, np.inf], dtype=np.float32), "nothing": np.empty((0, 3)), "number": np.array(7)}
    store.save_model(tmp_path / "tree.npz", "tree", arrays, {}, compressed=False)
    with np.load(tmp_path / "tree.npz") as file:
        for name, array in arrays.items():
            np.testing.assert_array_equal(file[name], array, strict=True)
            np.testing.assert_array_equal(store.load_model(tmp_path / "tree.npz")[1][name], array, strict=True)
    with zipfile.ZipFile(tmp_path / "tree.npz") as archive:
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}
    store.save_model(tmp_path / "again.npz", *store.load_model(tmp_path / "tree.npz"), compressed=False)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "tree.npz").read_bytes()
    with pytest.raises(ModelError, match="finite"):
        store.save_model(tmp_path / "again.npz", "tree", {"a": np.array([np.nan])}, {}, compressed=False)
    with pytest.raises(ModelError, match="finite"):
        store.save_model(tmp_path / "again.npz", "fpca", {"a": np.array([np.inf])}, {})


def test_a_file_larger_than_the_limit_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "LIMIT", 1000)
    values = np.random.default_rng(0).random(1000)
    store.save_model(tmp_path / "tree.npz", "tree", {"a": values}, {}, compressed=False)
    np.testing.assert_array_equal(store.load_model(tmp_path / "tree.npz")[1]["a"], values)


def test_every_truncation_is_refused(saved):
    data = saved.read_bytes()
    for n in range(0, len(data), 7):
        saved.write_bytes(data[:n])
        with pytest.raises(ModelError, match="damaged or not a model file"):
            store.load_model(saved)


def test_plain_npz_is_refused(tmp_path):
    np.savez(tmp_path / "x.npz", a=np.zeros(3))
    with pytest.raises(ModelError, match="not a motionenv model"):
        registry.load(tmp_path / "x.npz")


def test_a_bomb_is_refused_before_it_is_unpacked(saved):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)})
    rewrite(saved, a=stream.getvalue())
    with pytest.raises(ModelError, match="memory"):
        store.load_model(saved)


def test_an_unknown_kind_and_missing_arrays_are_refused(saved):
    with pytest.raises(ModelError, match="lacks data of a model of kind 'fpca'"):
        registry.load(saved)
    rewrite(saved, header=header(kind="dance"))
    with pytest.raises(ModelError, match="of kind 'dance'"):
        registry.load(saved)
