"""TRC files read by a parser written to OpenSim's documentation of the layout, by OpenSim itself, and by our reader."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.mocap import write, write_markers
from motionenv.mocap.readers import trc as reader
from motionenv.types import MARKERS, POSE, Markers, Motion

TO_GROUND = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # OpenSim's x is forward, y up, z right


def with_gaps(motion) -> Motion:
    """The last marker (right ankle) unknown in frames 3 to 7, the left arm throughout, everything in frame 9."""
    poses = motion.poses.copy()
    poses[3:8, POSE.index("right_knee_flexion")] = np.nan
    poses[:, 9:13] = np.nan
    poses[9] = np.nan
    return Motion(poses, motion.skeleton, motion.fps, "a walk")


def read(path) -> tuple[dict[str, str], list[str], np.ndarray, np.ndarray]:
    """Header, names, times and positions (frames, markers, 3), strictly by the layout."""
    lines = path.read_text().split("\n")
    assert lines[0].split("\t")[:3] == ["PathFileType", "4", "(X/Y/Z)"]
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    labels = lines[3].split("\t")
    names = labels[2::3]
    assert labels[:2] == ["Frame#", "Time"]
    assert set(labels[3::3]) | set(labels[4::3]) <= {""}
    assert lines[4].split("\t") == ["", "", *(f"{axis}{i + 1}" for i in range(len(names)) for axis in "XYZ")]
    assert (lines[5], lines[-1]) == ("", "")
    rows = [line.split("\t")[: 2 + 3 * len(names)] for line in lines[6:-1]]
    assert [row[0] for row in rows] == [str(i + 1) for i in range(int(header["NumFrames"]))]
    values = np.array([[float(word or "nan") for word in row] for row in rows])
    return header, names, values[:, 1], values[:, 2:].reshape(len(rows), int(header["NumMarkers"]), 3)


def test_layout_units_axes_and_gaps(walk, tmp_path):
    motion = with_gaps(walk)
    write(motion, tmp_path / "a.trc")
    header, names, times, points = read(tmp_path / "a.trc")
    assert tuple(names) == MARKERS
    assert (header["Units"], header["DataRate"], header["CameraRate"]) == ("mm", "120", "120")
    np.testing.assert_allclose(times, np.arange(len(points)) / 120, atol=1e-6)
    poses = motion.poses.copy()  # CMU's walker faces y: a quarter turn to the right brings him to face x
    quarters = int(np.round(np.median(walk.poses[:, 5]) / (np.pi / 2)))
    world = markers(poses, motion.skeleton)
    for _ in range(quarters % 4):
        world = world[..., [1, 0, 2]] * [1, -1, 1]
    np.testing.assert_allclose(points, 1000 * world @ TO_GROUND.T, atol=1e-4)
    assert points[-1, 2, 0] - points[0, 2, 0] > 2000
    assert np.isnan(points[9]).all()
    assert np.isnan(points[3, -1]).all()


@pytest.mark.integration
def test_opensim_reads_markers_and_blanks(walk, tmp_path):
    o = pytest.importorskip("opensim", reason="pip install opensim")
    o.Logger.setLevelString("Off")
    write(with_gaps(walk), tmp_path / "a.trc")
    table = o.TimeSeriesTableVec3(str(tmp_path / "a.trc"))
    _, names, _, points = read(tmp_path / "a.trc")
    assert list(table.getColumnLabels()) == names
    assert table.getTableMetaDataString("Units") == "mm"
    found = [[table.getRowAtIndex(t).getElt(0, i).to_numpy() for i in range(15)] for t in range(12)]
    np.testing.assert_array_equal(np.array(found), points[:12])


def quarter_turns(points) -> list[np.ndarray]:
    x, y, z = np.moveaxis(points, -1, 0)
    return [np.stack([*xy, z], axis=-1) for xy in ((x, y), (-y, x), (-x, -y), (y, -x))]


def test_our_reader_gives_the_markers_back_up_to_where_forward_is(walk, any_motion, tmp_path):
    for motion in (with_gaps(walk), any_motion(1), any_motion(2, frames=1, fps=29.97)):
        write(motion, tmp_path / "a.trc")
        found = reader.read(tmp_path / "a.trc", up="y")
        assert found.names == MARKERS
        assert found.fps == pytest.approx(motion.fps, rel=1e-9)
        truth = markers(motion.poses, motion.skeleton)
        np.testing.assert_array_equal(np.isnan(found.positions), np.isnan(truth))
        assert min(np.nanmax(np.abs(turned - truth)) for turned in quarter_turns(found.positions)) < 1e-7


def test_captured_points_keep_their_names_and_the_worlds_x(tmp_path):
    positions = np.random.default_rng(0).normal(size=(4, 3, 3))
    positions[1, 2] = np.nan
    write_markers(Markers(("LASI", "R Knee", "Пята"), positions, 100.0), tmp_path / "a.trc")
    _, names, _, points = read(tmp_path / "a.trc")
    assert names == ["LASI", "R Knee", "Пята"]
    np.testing.assert_allclose(points, 1000 * positions @ TO_GROUND.T, atol=1e-5)
    np.testing.assert_allclose(reader.read(tmp_path / "a.trc", up="y").positions, positions, atol=1e-8)


@pytest.mark.parametrize("name", ["a\tb", "a\nb", " "])
def test_names_that_would_break_the_table_are_refused(name, tmp_path):
    with pytest.raises(MotionError, match="without tabs and line ends"):
        write_markers(Markers((name,), np.zeros((2, 1, 3)), 100.0), tmp_path / "a.trc")
    assert not list(tmp_path.iterdir())
