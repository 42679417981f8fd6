"""Cameras that turn are told from those that stand, walk or see nothing, on views of textures with known rotations."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

from motionenv.errors import MotionError
from motionenv.lifting import camera_motion
from motionenv.types import Points

HIGH, WIDE, FRAMES = 96, 128, 24
INNER = np.array([[110.0, 0, 63.5], [0, 110, 47.5], [0, 0, 1]])
STEPS = np.linspace(0, 1, FRAMES)


def texture(rng: np.random.Generator) -> np.ndarray:
    """Grey levels (512, 512) of structure at several scales, periodic."""
    rough = sum(gaussian_filter(rng.standard_normal((512, 512)), s, mode="wrap") * s for s in (1.5, 4, 12))
    return 128 + 35 * rough / rough.std()


def filmed(turns: Rotation, centres: np.ndarray | float = 0.0, contrast: float = 1.0) -> list[np.ndarray]:
    """Pictures, with noise, by a camera at `centres` (frames, 3) of a far wall and a near floor."""
    rng = np.random.default_rng(8)
    wall, floor = texture(rng), texture(rng)
    rows, columns = np.mgrid[:HIGH, :WIDE]
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(INNER).T
    pictures = []
    for turn, centre in zip(turns, np.broadcast_to(centres, (FRAMES, 3)), strict=True):
        ways = rays @ turn.as_matrix()  # the inverse turn: from the camera to the world
        down = ways[..., 1] * 6 > ways[..., 2] * 1.5  # the floor, 1.5 m below, is nearer than the wall, 6 m away
        far = np.where(down, (1.5 - centre[1]) / np.where(down, ways[..., 1], 1), (6 - centre[2]) / ways[..., 2])
        x, y, z = np.moveaxis(centre + far[..., None] * ways, -1, 0)
        seen = [
            map_coordinates(plane, [60 * b, 60 * x], order=1, mode="grid-wrap") for plane, b in ((wall, y), (floor, z))
        ]
        grey = 128 + contrast * (np.where(down, seen[1], seen[0]) - 128)
        pictures.append(np.clip(grey[..., None] + 3 * rng.standard_normal((HIGH, WIDE, 3)), 0, 255).astype(np.uint8))
    return pictures


def apart(found: np.ndarray, true: Rotation) -> float:
    """Greatest angle [degrees] between rotations (frames, 3, 3) and true ones, relative to the first frame."""
    return float(np.degrees((Rotation.from_matrix(found) * (true * true[0].inv()).inv()).magnitude().max()))


def pan() -> Rotation:
    """A turn by 25 degrees, with a roll and a nod."""
    wave = np.sin(7 * STEPS)
    return Rotation.from_rotvec(np.radians(np.stack([1.5 * wave, 25 * STEPS, 2 * wave], axis=-1)))


def shake() -> Rotation:
    rng = np.random.default_rng(2)
    return Rotation.from_rotvec(np.radians(0.6) * gaussian_filter(rng.standard_normal((FRAMES, 3)), (1.0, 0)) * 2)


@pytest.mark.parametrize("turns", [pan(), shake()], ids=["pan", "shake"])
def test_turns_are_found_to_a_tenth_of_a_degree(turns):
    motion = camera_motion(filmed(turns), inner=INNER)
    assert motion.kind == "turns"
    assert not motion.doubtful
    assert apart(motion.rotations, turns) < 0.1


def test_a_pan_tells_the_focal_length():
    motion = camera_motion(filmed(pan()))
    assert motion.inner[0, 0] == pytest.approx(110, rel=0.05)
    assert motion.inner[:2, 2].tolist() == [63.5, 47.5]
    assert apart(motion.rotations, pan()) < 1.0


def test_a_standing_camera_gives_the_identity_whatever_people_do():
    pictures = filmed(Rotation.identity(FRAMES))
    boxes = []
    for t, picture in enumerate(pictures):
        boxes.append([[3 * t, 10, 3 * t + 35, 95]])
        picture[10:96, 3 * t : 3 * t + 36] = 30
    for people in (None, boxes):
        motion = camera_motion(pictures, people)
        assert motion.kind == "still"
        np.testing.assert_array_equal(motion.rotations, np.tile(np.eye(3), (FRAMES, 1, 1)))
    points = Points(np.full((FRAMES, 15, 2), 50.0), 30, "px")
    assert motion.steadied(points) is points


def test_a_camera_that_walks_is_doubted():
    centres = STEPS[:, None] * [1.2, 0, 0]
    assert camera_motion(filmed(Rotation.identity(FRAMES), centres), inner=INNER).doubtful


def test_nothing_is_told_without_structure():
    motion = camera_motion(filmed(pan(), contrast=0.0), inner=INNER)
    assert motion.kind == "unknown"
    assert (motion.rotations == np.eye(3)).all()


def test_small_frames_serve_boxes_and_intrinsics_of_a_large_film():
    twice = INNER * [[2], [2], [1]] + [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    people = [[[0, 0, 60, 190]]] * FRAMES
    large = camera_motion(filmed(pan()), people, twice, width=2 * WIDE)
    small = camera_motion(filmed(pan()), np.array(people) / 2, INNER)
    np.testing.assert_allclose(large.rotations, small.rotations, atol=1e-9)
    np.testing.assert_allclose(large.inner, twice)


def test_steadied_points_are_those_of_a_standing_camera():
    turns, rng = pan(), np.random.default_rng(4)
    world = rng.uniform([-1, -1, 4], [1, 1, 6], (FRAMES, 15, 3))
    seen = np.einsum("tab,tmb->tma", turns.as_matrix(), world) @ INNER.T
    seen = seen[..., :2] / seen[..., 2:]
    points = Points(seen, 30, "px", feet=seen[:, :4])
    motion = camera_motion(filmed(turns), inner=INNER)
    for level, stands in ((False, turns[0]), (True, turns.mean())):
        true = world @ stands.as_matrix().T @ INNER.T
        steadied = motion.steadied(points, level=level)
        assert np.abs(steadied.positions - true[..., :2] / true[..., 2:]).max() < 0.5
        np.testing.assert_array_equal(steadied.feet, steadied.positions[:, :4])
    with pytest.raises(MotionError, match="24 frames, got 3"):
        motion.steadied(Points(points.positions[:3], 30, "px"))


def test_what_is_missing_is_told():
    with pytest.raises(MotionError, match="at least one picture"):
        camera_motion([], inner=INNER)
    with pytest.raises(MotionError, match="readable twice"):
        camera_motion(iter(filmed(shake())))
    with pytest.raises(MotionError, match="boxes for each frame, got those of 2"):
        camera_motion(filmed(shake()), [[], []], INNER)
