import io
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from motionenv.body import limb_radii
from motionenv.errors import FormatError, MotionError
from motionenv.mocap import npz
from motionenv.mocap.npz import load_arrays
from motionenv.models.synthesis import synthesize
from motionenv.types import Motion, Skeleton


def motion(poses=None, name="a walk") -> Motion:
    rng = np.random.default_rng(3)
    skeleton = Skeleton(rng.normal(size=(16, 3)), rng.uniform(0.02, 0.1, (22, 2)), 1.75)
    return Motion(rng.normal(size=(5, 25)) if poses is None else poses, skeleton, 120.0, name)


@settings(max_examples=30, deadline=None)
@given(
    hnp.arrays(np.float64, st.sampled_from([(0, 25), (1, 25), (7, 25), (2, 3, 25)]), elements=st.floats(width=64)),
    st.floats(1e-3, 1e4),
    st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20),
)
def test_what_is_written_is_read_to_the_bit(tmp_path_factory, poses, fps, name):
    path = tmp_path_factory.mktemp("npz") / "a.npz"
    sent = Motion(poses, motion().skeleton, fps, name)
    npz.write(sent, path)
    got = npz.read(path)
    np.testing.assert_array_equal(got.poses, sent.poses)
    np.testing.assert_array_equal(got.skeleton.offsets, sent.skeleton.offsets)
    np.testing.assert_array_equal(got.skeleton.radii, sent.skeleton.radii)
    assert (got.fps, got.name, got.skeleton.height) == (sent.fps, sent.name, sent.skeleton.height)


def changed(folder, **changes):
    """A good file with some of its arrays exchanged, or left out where None."""
    path = folder / "a.npz"
    npz.write(motion(), path)
    with np.load(path) as file:
        fields = {**dict(file), **changes}
    np.savez(path, **{name: value for name, value in fields.items() if value is not None})
    return path


BAD = {
    "another kind": ({"format": "kinect"}, "of another kind"),
    "no format": ({"format": None}, "of another kind"),
    "newer": ({"version": np.array(99)}, "is of version 99; this motionenv reads version 1"),
    "no poses": ({"poses": None}, "has no poses"),
    "other pose vector": ({"pose": np.array(["x"] * 25)}, "pose: its pose vector has other entries than root_x"),
    "poses of another shape": ({"poses": np.zeros((3, 24))}, "has no valid motion: .*must have shape"),
    "no frame rate": ({"fps": np.array(np.nan)}, "has no valid motion: fps must be a number of frames"),
    "frame rate a list": ({"fps": np.zeros(3)}, "has no valid motion"),
    "filled of another shape": ({"filled": np.zeros((5, 24), dtype=bool)}, "has no valid motion: Motion.filled must"),
    "NaN skeleton": ({"offsets": np.full((16, 3), np.nan)}, "Skeleton.offsets must be finite"),
    "another body": ({"radii": np.ones((12, 2))}, r"Skeleton.radii must have shape \(22, 2\), got \(12, 2\)"),
    "no thickness": ({"radii": np.zeros((22, 2))}, "Skeleton.radii must be finite and above 0, got 0"),
    "infinite height": ({"height": np.array(np.inf)}, "Skeleton.height must be finite and above 0, got inf"),
}


@pytest.mark.parametrize(("changes", "problem"), BAD.values(), ids=BAD)
def test_other_contents_are_refused(tmp_path, changes, problem):
    path = changed(tmp_path, **changes)
    with pytest.raises(FormatError, match=problem) as caught:
        npz.read(path)
    assert str(path) in str(caught.value)


def test_pickles_are_never_loaded(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, format=np.array([{"a": 1}], dtype=object))
    with pytest.raises(FormatError, match=r"format\.npy: has Python objects"):
        npz.read(path)


def test_a_bomb_is_refused_by_its_headers(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("poses.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (1 << 30, 25)})
        file.write(bytes(1 << 20))
    assert path.stat().st_size < 10_000
    with pytest.raises(FormatError, match=r"poses\.npy: has arrays of more than 1024 MiB"):
        npz.read(path)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_cut_files_are_refused(tmp_path, share):
    path = tmp_path / "a.npz"
    npz.write(motion(), path)
    raw = path.read_bytes()
    path.write_bytes(raw[: int(share * len(raw))])
    with pytest.raises(FormatError, match="is empty|damaged"):
        npz.read(path)


def test_random_damage_gives_an_answer_or_an_error(tmp_path):
    path = tmp_path / "a.npz"
    npz.write(motion(), path)
    raw = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    rng = np.random.default_rng(11)
    refused = 0
    for _ in range(300):
        data = raw.copy()
        where = rng.integers(0, len(data), size=rng.integers(1, 20))
        data[where] = rng.integers(0, 256, size=where.shape)
        path.write_bytes(data.tobytes())
        try:
            npz.read(path)
        except FormatError:
            refused += 1
    assert refused > 250


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(MotionError, match="choose a folder that exists"):
        npz.write(motion(), tmp_path / "no" / "a.npz")


def test_in_memory_it_is_a_plain_zip_that_is_read_the_same(tmp_path):
    sent = motion()
    data = b"".join(npz.encode(sent))
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
    (tmp_path / "a.npz").write_bytes(data)
    npz.write(sent, tmp_path / "b.npz")
    with np.load(tmp_path / "a.npz") as stored, np.load(tmp_path / "b.npz") as deflated:
        assert set(stored) == set(deflated)
        for name in stored:
            np.testing.assert_array_equal(stored[name], deflated[name])
    got = npz.read(tmp_path / "a.npz")
    assert got.poses.tobytes() == sent.poses.tobytes()
    assert got.skeleton.offsets.tobytes() == sent.skeleton.offsets.tobytes()


def test_what_a_model_filled_is_kept_and_otherwise_not_in_the_file(tmp_path):
    plain = motion()
    filled = np.random.default_rng(1).random(plain.poses.shape) < 0.5
    sent = Motion(plain.poses, plain.skeleton, plain.fps, plain.name, filled)
    npz.write(sent, tmp_path / "a.npz")
    (tmp_path / "b.npz").write_bytes(b"".join(npz.encode(sent)))
    for name in "ab":
        got = npz.read(tmp_path / f"{name}.npz").filled
        assert got.dtype == bool
        np.testing.assert_array_equal(got, filled)
    npz.write(plain, tmp_path / "c.npz")
    with np.load(tmp_path / "c.npz") as file:
        assert "filled" not in file
    assert npz.read(tmp_path / "c.npz").filled is None


def test_only_wanted_arrays_are_loaded_and_objects_never(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, trans=np.arange(6.0).reshape(2, 3), labels=np.array([{"a": 1}], dtype=object))
    arrays, names = load_arrays(path.read_bytes(), path, {"trans", "poses"})
    assert set(arrays) == {"trans"}
    assert set(names) == {"trans", "labels"}
    np.testing.assert_array_equal(arrays["trans"], [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(FormatError, match=r"labels\.npy: has Python objects, which are never loaded"):
        load_arrays(path.read_bytes(), path, {"labels"})


@pytest.mark.parametrize("raw", [b"x" * 300, b"PK\3\4" + bytes(300)])
def test_other_files_are_refused_in_our_words(raw):
    with pytest.raises(FormatError, match="^a.npz: isn't an NPZ file, or is damaged$"):
        load_arrays(raw, "a.npz", {"trans"})


def test_bodies_of_motionenv_0_3_are_read_with_their_thickness(tmp_path):
    """Its 17 limbs had no face and no hair."""
    motion = synthesize("walk/fpca", 1, 30, seed=1, height=1.7)
    npz.write(motion, tmp_path / "now.npz")
    with np.load(tmp_path / "now.npz") as file:
        fields = dict(file)
    for girth in (1.0, 1.2):
        old = np.full((17, 2), 0.03)
        old[0] = 0.062 * 1.7 * girth, 0.079 * 1.7 * girth
        np.savez(tmp_path / "old.npz", **{**fields, "radii": old})
        read = npz.read(tmp_path / "old.npz")
        np.testing.assert_array_equal(read.poses, motion.poses)
        np.testing.assert_allclose(read.skeleton.radii, limb_radii(1.7, girth))
    np.testing.assert_array_equal(npz.read(tmp_path / "now.npz").skeleton.radii, motion.skeleton.radii)
