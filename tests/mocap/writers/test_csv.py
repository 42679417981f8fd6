"""CSV files read by Python's csv module and by NumPy."""

import csv

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from motionenv.body import markers
from motionenv.mocap import write
from motionenv.mocap.writers import csv as csv_writer
from motionenv.types import Motion


def read(path) -> tuple[list[str], np.ndarray]:
    with open(path, newline="") as file:
        names, *rows = csv.reader(file)
    return names, np.array([[float(word) if word else np.nan for word in row] for row in rows])


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), holes=st.floats(0, 0.3))
def test_numbers_come_back_to_the_bit(seed, holes, any_motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    motion = any_motion(seed)
    poses = np.where(np.random.default_rng(seed).random(motion.poses.shape) < holes, np.nan, motion.poses)
    write(Motion(poses, motion.skeleton, motion.fps), path)
    names, table = read(path)
    assert tuple(names) == csv_writer.COLUMNS
    np.testing.assert_array_equal(table[:, 0], np.arange(5) / motion.fps)
    np.testing.assert_array_equal(table[:, 1:26], poses)
    np.testing.assert_array_equal(table[:, 26:].reshape(5, 15, 3), markers(poses, motion.skeleton))


def test_numpy_reads_a_walk_by_the_names_of_its_columns(walk, tmp_path):
    write(walk, tmp_path / "a.csv")
    table = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True)
    assert table.dtype.names == csv_writer.COLUMNS
    assert all(name.isidentifier() for name in table.dtype.names)
    np.testing.assert_array_equal(table["left_knee_flexion_rad"], walk.poses[:, 20])
    np.testing.assert_array_equal(table["root_z_m"], table["pelvis_z_m"])
    np.testing.assert_allclose(np.diff(table["time_s"]), 1 / 120, atol=1e-12)


def test_the_columns():
    columns = csv_writer.COLUMNS
    assert len(columns) == len(set(columns)) == 1 + 25 + 45
    assert columns[:5] == ("time_s", "root_x_m", "root_y_m", "root_z_m", "root_tilt_rad")
    assert columns[25:28] == ("right_knee_flexion_rad", "head_x_m", "head_y_m")
    assert columns[-1] == "right_ankle_z_m"
