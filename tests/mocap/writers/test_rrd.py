"""RRD files read by Rerun's own reader."""

import io
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from motionenv.body import forward, markers
from motionenv.body.skeleton import EDGES, SEGMENT_ORIGIN, SEGMENTS
from motionenv.errors import MotionError
from motionenv.mocap import write
from motionenv.mocap.writers import rrd
from motionenv.types import ANGLES, POSE, Camera, Event, Motion


class File:
    """Rows of an RRD file by entity and component."""

    def __init__(self, path):
        reader = RrdReader(path)
        (self.recording,) = reader.recordings()
        self.rows: dict[tuple[str, str], list] = {}
        for chunk in reader.store().stream().to_chunks():
            batch = chunk.to_record_batch()
            times = (
                batch.column("time").cast("int64").to_pylist() if "time" in batch.schema.names else [None] * len(batch)
            )
            for component in set(batch.schema.names) - {"time", "RowId", "rerun.controls.RowId"}:
                values = batch.column(component).to_pylist()
                kept = [row for row in zip(times, values, strict=True) if row[1] is not None]
                self.rows.setdefault((chunk.entity_path, component), []).extend(kept)

    def entities(self) -> set[str]:
        return {path for path, _ in self.rows}

    def get(self, path: str, component: str) -> list:
        """Values in the order of time."""
        return [value for _, value in sorted(self.rows[path, component], key=lambda row: row[0])]

    def get_static(self, path: str, component: str):
        ((_, value),) = self.rows[path, component]
        return value

    def seconds(self, path: str, component: str) -> np.ndarray:
        return 1e-9 * np.sort([time for time, _ in self.rows[path, component]])


def gappy(walk) -> Motion:
    """A lower body whose left knee is unknown in frames 10 to 19, and everything from frame 30 on."""
    poses = walk.poses[:40].copy()
    poses[:, 6:17] = np.nan
    poses[10:20, POSE.index("left_knee_flexion")] = np.nan
    poses[30:] = np.nan
    return Motion(poses, walk.skeleton, walk.fps, "lower body")


def test_markers_body_and_angles_of_a_walk(walk, tmp_path):
    write(walk, tmp_path / "a.rrd")
    file = File(tmp_path / "a.rrd")
    points = np.array(file.get("/world/markers", "Points3D:positions"))
    np.testing.assert_allclose(points, markers(walk.poses, walk.skeleton), atol=1e-5)
    seconds = file.seconds("/world/markers", "Points3D:positions")
    np.testing.assert_allclose(seconds, np.arange(len(walk.poses)) / 120, atol=1e-8)
    lines = np.array(file.get("/world/skeleton", "LineStrips3D:strips"))
    np.testing.assert_allclose(lines, points[:, np.array(EDGES)], atol=1e-6)
    nodes, rotations = forward(walk.poses, walk.skeleton)
    for segment, name in enumerate(SEGMENTS):
        place = np.array(file.get(f"/world/body/{name}", "Transform3D:translation"))[:, 0]
        turns = Rotation.from_quat(np.array(file.get(f"/world/body/{name}", "Transform3D:quaternion"))[:, 0])
        np.testing.assert_allclose(place, nodes[:, SEGMENT_ORIGIN[segment]], atol=1e-5)
        np.testing.assert_allclose(turns.as_matrix(), rotations[:, segment], atol=1e-5)
        assert len(file.rows[f"/world/body/{name}", "Mesh3D:vertex_positions"]) == 1
    knee = np.array(file.get("/joint_angles/left/knee_flexion", "Scalars:scalars"))[:, 0]
    np.testing.assert_allclose(np.radians(knee), walk.poses[:, POSE.index("left_knee_flexion")], atol=1e-9)


def test_what_is_unknown_is_not_there(walk, tmp_path):
    motion = gappy(walk)
    write(motion, tmp_path / "a.rrd")
    file = File(tmp_path / "a.rrd")
    truth = markers(motion.poses, motion.skeleton)
    for frame, points in enumerate(file.get("/world/markers", "Points3D:positions")):
        known = np.isfinite(truth[frame]).all(-1)
        np.testing.assert_allclose(np.reshape(points, (-1, 3)), truth[frame, known], atol=1e-5)
    ids = file.get("/world/markers", "Points3D:keypoint_ids")
    assert [len(i) for i in ids] == np.isfinite(truth).all(-1).sum(1).tolist()
    shown = {path.rpartition("/")[2] for path in file.entities() if path.startswith("/world/body/")}
    assert shown == {"torso", *(f"{s}_{part}" for s in ("left", "right") for part in ("thigh", "shin", "foot"))}
    angles = {path for path in file.entities() if path.startswith("/joint_angles/")}
    assert len(angles) == 8 < len(ANGLES)
    cleared = file.seconds("/world/body/left_shin", "Clear:is_recursive") * walk.fps
    np.testing.assert_allclose(cleared, [10, 30], atol=1e-6)
    back = file.seconds("/world/body/left_shin", "Mesh3D:vertex_positions") * walk.fps
    np.testing.assert_allclose(back, [0, 20], atol=1e-6)
    moved = file.seconds("/world/body/left_shin", "Transform3D:translation") * walk.fps
    np.testing.assert_allclose(moved, [*range(10), *range(20, 30)], atol=1e-6)
    np.testing.assert_allclose(
        file.seconds("/joint_angles/left/knee_flexion", "Clear:is_recursive") * walk.fps, [10, 30]
    )


class Angles:
    names = ("left_knee_flexion", "left_foot_progression")
    values = np.stack([np.linspace(0, 60, 40), np.full(40, np.nan)], axis=1)


def looking() -> Camera:
    """From the walker's side."""
    intrinsics = [[300.0, 0, 79.5], [0, 300.0, 59.5], [0, 0, 1]]
    return Camera(intrinsics, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [-1.0, 1.0, 4.0], 160, 120)


def test_camera_pictures_events_and_clinical_angles(walk, tmp_path):
    motion, camera = Motion(walk.poses[:40], walk.skeleton, 100.0), looking()
    ramp = np.arange(40, dtype=np.uint8)[:, None, None, None] + np.zeros((40, 120, 160, 3), dtype=np.uint8)
    events = [Event(0.25, "toe_off", "right"), Event(0.1, "initial_contact", "left")]
    rrd.write_rrd(motion, tmp_path / "a.rrd", camera=camera, pictures=iter(ramp), events=events, angles=Angles())
    file = File(tmp_path / "a.rrd")
    blobs = file.get("/world/camera/picture", "EncodedImage:blob")
    shades = [np.asarray(Image.open(io.BytesIO(bytes(blob[0])))).mean() for blob in blobs]
    np.testing.assert_allclose(shades, np.arange(40), atol=1)
    np.testing.assert_allclose(file.seconds("/world/camera/picture", "EncodedImage:blob"), np.arange(40) / 100)
    place = np.array(file.get_static("/world/camera", "Transform3D:translation"))[0]
    np.testing.assert_allclose(place, camera.centre, atol=1e-6)
    matrix = np.array(file.get_static("/world/camera", "Pinhole:image_from_camera"))[0].reshape(3, 3).T
    turned = np.array(file.get_static("/world/camera", "Transform3D:mat3x3"))[0].reshape(3, 3).T  # by columns
    point = np.array([0.3, 0.2, 1.1])
    seen = matrix @ turned.T @ (point - place)
    np.testing.assert_allclose(seen[:2] / seen[2] - 0.5, camera.project(point)[0], atol=1e-3)  # from a pixel's corner
    assert file.get("/events", "TextLog:text") == [["left initial contact"], ["right toe off"]]
    np.testing.assert_allclose(file.seconds("/events", "TextLog:text"), [0.1, 0.25])
    knee = np.array(file.get("/clinical_angles/left/knee_flexion", "Scalars:scalars"))[:, 0]
    np.testing.assert_allclose(knee, Angles.values[:, 0])
    assert "/clinical_angles/left/foot_progression" not in file.entities()


def test_same_motion_same_content(walk, tmp_path):
    files = []
    for name in "ab":
        write(gappy(walk), tmp_path / f"{name}.rrd")
        files.append(File(tmp_path / f"{name}.rrd"))
    assert files[0].recording.recording_id == files[1].recording.recording_id
    assert files[0].rows == files[1].rows
    write(walk, tmp_path / "c.rrd")
    assert File(tmp_path / "c.rrd").recording.recording_id != files[0].recording.recording_id


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"pictures": np.zeros((40, 120, 160, 3), np.uint8)}, "pass camera= too"),
        ({"pictures": np.zeros((39, 120, 160, 3), np.uint8), "camera": looking()}, "must be 40, one per frame, got 39"),
        ({"pictures": np.zeros((41, 120, 160, 3), np.uint8), "camera": looking()}, "must be 40 of shape .* number 41"),
        (
            {"pictures": np.zeros((40, 12, 16, 3), np.uint8), "camera": looking()},
            r"got \(12, 16, 3\), uint8 as number 1",
        ),
        ({"pictures": np.zeros((40, 120, 160, 3)), "camera": looking()}, "got .* float64 as number 1"),
    ],
)
def test_what_does_not_fit_is_named(given, problem, walk, tmp_path):
    with pytest.raises(MotionError, match=problem):
        rrd.write_rrd(gappy(walk), tmp_path / "a.rrd", **given)
    assert not list(tmp_path.iterdir())


ABSENT = """
import sys
sys.modules["rerun"] = None
import importlib.util
import numpy as np
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.mocap import write
from motionenv.types import Motion
try:
    write(Motion(np.zeros((2, 25)), from_height(), 100.0), sys.argv[1])
except MotionError as error:
    print(error)
"""


@pytest.mark.parametrize("switched", ["", "off"])
def test_without_rerun_it_says_what_to_do(switched, tmp_path):
    environment = {"RERUN": switched} if switched else {}
    script = ABSENT.replace('sys.modules["rerun"] = None\n', "") if switched else ABSENT
    done = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "a.rrd"], capture_output=True, text=True, env=environment
    )
    assert ("unset it" if switched else "pip install motionenv[rerun]") in done.stdout
    assert not list(tmp_path.iterdir())
