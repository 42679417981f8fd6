"""Files are written whole or not at all, and sizes of arrays are known before they are unpacked."""

import zipfile

import numpy as np
import pytest

from motionenv._core.files import atomic_write, unpacked_size
from motionenv.errors import MotionError


def test_the_file_appears_at_the_end(tmp_path):
    path = tmp_path / "a.txt"
    with atomic_write(path) as part:
        part.write_text("new")
        assert part.suffix == ".txt"
        assert not path.exists()
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fail():
        with atomic_write(path) as part:
            part.write_text("half")
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        fail()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_missing_folder_is_said(tmp_path):
    with (
        pytest.raises(MotionError, match="No such file or directory; choose a folder"),
        atomic_write(tmp_path / "no/a"),
    ):
        pass


def test_permissions_are_those_of_a_new_file(tmp_path):
    (tmp_path / "plain").touch()
    with atomic_write(tmp_path / "ours") as part:
        part.touch()
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize("array", [np.zeros((40, 7)), np.zeros((3, 0, 5)), np.float32(2), np.array(["left", "right"])])
def test_sizes_of_packed_arrays_are_known_before_they_are_unpacked(tmp_path, save, array):
    save(tmp_path / "some.npz", array=array)
    with zipfile.ZipFile(tmp_path / "some.npz") as archive:
        (member,) = archive.infolist()
        size, dtype = unpacked_size(archive, member)
    assert dtype == np.asarray(array).dtype
    assert np.asarray(array).nbytes <= size <= np.asarray(array).nbytes + 128  # NumPy's header


def test_arrays_packed_otherwise_have_no_known_size(tmp_path):
    with zipfile.ZipFile(tmp_path / "some.npz", "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("array.npy", b"anything")
        with pytest.raises(ValueError, match="unknown compression method"):
            unpacked_size(archive, archive.getinfo("array.npy"))
