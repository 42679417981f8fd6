"""The raycast engine as users call it: batches, cameras, threads, shadows, refusals."""

import numpy as np
import pytest

from motionenv.body import LIMBS, from_height, limb_segments, mirror
from motionenv.errors import MotionError
from motionenv.render import Raycaster, Scene, render
from motionenv.render.cameras import look_at

SKELETON = from_height(1.75)
PLAIN = Scene(shadows=False)
ARM = ("upper_arm", "forearm", "hand")


def camera(eye=(1.0, -3.5, 1.2), size=64, **more):
    return look_at(eye, (0, 0, 0.9), **{"width": size, "height": size, **more})


def same(a, b):
    np.testing.assert_array_equal(a.depth, b.depth)
    np.testing.assert_array_equal(a.limbs, b.limbs)
    np.testing.assert_array_equal(a.rgb, b.rgb)


def test_limbs_are_where_camera_project_says(walking):
    """Each limb's centre of mass in the picture lies on the projection of its axis, at its depth less its radius."""
    view = camera(size=400)
    pose = walking(1)[0]
    frame = render(pose, SKELETON, view, scene=PLAIN)
    pixels, depth = view.project(limb_segments(pose, SKELETON))
    for i, name in enumerate(LIMBS):
        rows, columns = np.nonzero(frame.limbs == i + 1)
        if len(rows) < 400 or name.endswith(("trunk", "shoulder", "pelvis", "hair", "ears")):
            continue  # hidden for the most part, or overlapped by others
        a, b = pixels[i]
        across = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
        off = (np.stack([columns, rows], 1) - a) @ across
        radius = SKELETON.radii[i].max() / depth[i].min() * view.K[0, 0]
        assert np.abs(off).max() < 1.05 * radius + 1
        seen = frame.depth[rows, columns]
        assert seen.min() > depth[i].min() - 1.05 * SKELETON.radii[i].max()
        assert seen.max() < depth[i].max() + SKELETON.radii[i].max()


def test_mirrored_pose_gives_mirrored_picture(walking):
    view = look_at((4, 0, 1), (0, 0, 0.9), width=80, height=80)
    pose = walking(1)[0]
    pose[[1, 5]] = 0
    left, right = (render(p, SKELETON, view, rgb=False) for p in (pose, mirror(pose)))
    swapped = [name.replace("left", "x").replace("right", "left").replace("x", "right") for name in LIMBS]
    other = np.array([0, *(LIMBS.index(name) + 1 for name in swapped)])
    assert (other[right.limbs[:, ::-1]] != left.limbs).mean() < 1e-3
    both = np.isfinite(left.depth) & np.isfinite(right.depth[:, ::-1])
    assert np.abs(left.depth[both] - right.depth[:, ::-1][both]).max() < 1e-3


@pytest.mark.parametrize("scene", [PLAIN, Scene(), Scene(samples=2), Scene(ground=False)])
def test_same_bits_whatever_the_batch_and_the_threads(scene, walking):
    poses = walking(150)
    views = [camera(), camera((3, 0, 1.5))]
    one = Raycaster(scene).render(poses[:, None], SKELETON, views)
    same(one, Raycaster(scene, threads=3).render(poses[:, None], SKELETON, views))
    single = render(poses[7], SKELETON, views[1], scene=scene)
    np.testing.assert_array_equal(one.rgb[7, 1], single.rgb)
    np.testing.assert_array_equal(one.depth[7, 1], single.depth)


def test_frame_of_an_earlier_call_can_be_overwritten(walking):
    caster = Raycaster()
    out = caster.render(walking(3), SKELETON, camera())
    again = caster.render(walking(3, seed=1), SKELETON, camera(), out=out)
    assert again is out
    same(out, caster.render(walking(3, seed=1), SKELETON, camera()))
    with pytest.raises(MotionError, match=r"out\.rgb"):
        caster.render(walking(4), SKELETON, camera(), out=out)
    with pytest.raises(MotionError, match=r"out\.rgb"):
        caster.render(walking(3), SKELETON, camera(), out=out, rgb=False)


def test_shadow_falls_away_from_the_light_and_only_on_the_ground(walking):
    """From above, what turns dark lies where the limbs' axes land when they slide along the key light."""
    view = look_at((0.01, 0, 7), (0, 0, 0), width=200, height=200)
    pose = walking(1)[0]
    scene = Scene(samples=1)
    with_shadow, without = (render(pose, SKELETON, view, scene=s) for s in (scene, PLAIN))
    changed = (with_shadow.rgb != without.rgb).any(-1)
    assert not changed[with_shadow.limbs > 0].any()
    ends = limb_segments(pose, SKELETON)
    axis = ends[:, :1] + np.linspace(0, 1, 20)[:, None] * (ends[:, 1:] - ends[:, :1])
    landed = axis - axis[..., 2:] / scene.key[2] * np.array(scene.key)
    pixels = np.rint(view.project(landed)[0]).astype(int).reshape(-1, 2)
    free = with_shadow.limbs[pixels[:, 1], pixels[:, 0]] == 0
    assert changed[pixels[:, 1], pixels[:, 0]][free].all()
    assert changed.sum() < 6000
    darker = without.rgb[changed].astype(int).sum(-1) - with_shadow.rgb[changed].astype(int).sum(-1)
    assert darker.min() >= 0


def test_samples_smooth_the_edges_and_nothing_else(walking):
    pose, view = walking(1)[0], camera(size=128)
    rough, smooth = (render(pose, SKELETON, view, scene=Scene(samples=n, shadows=False)) for n in (1, 4))
    np.testing.assert_array_equal(rough.limbs, smooth.limbs)
    np.testing.assert_array_equal(rough.depth, smooth.depth)
    difference = np.abs(rough.rgb.astype(int) - smooth.rgb).max(-1)
    assert np.median(difference) <= 1
    inside = np.ones_like(rough.limbs, bool)
    for shift in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        inside &= np.roll(rough.limbs, shift, (0, 1)) == rough.limbs
    assert np.quantile(difference[inside & (rough.limbs > 0)], 0.95) <= 4


def test_lights_on_the_camera_side_make_the_body_brighter(walking):
    view, pose = camera((0, -4, 1)), walking(1)[0]
    front, back = (
        render(pose, SKELETON, view, scene=Scene(key=(0, y, 0.5), shadows=False, ground=False)) for y in (-1, 1)
    )
    body = front.limbs > 0
    assert front.rgb[body].mean() > back.rgb[body].mean() + 10


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scene", [Scene(), Scene(samples=2, shadows=False)])
def test_unknown_limbs_are_left_out_and_hide_nothing(scene, walking):
    """Without arms, each pixel shows the nearest of the other limbs; a body of which nothing is known is no body."""
    view = camera(size=96)
    whole = walking(4)
    poses = whole.copy()
    poses[1, 9:13] = poses[2, 6:17] = poses[3] = np.nan
    all_limbs, part = (render(p, SKELETON, view, scene=scene) for p in (whole, poses))
    np.testing.assert_array_equal(part.rgb[0], all_limbs.rgb[0])
    arm = [i + 1 for i, name in enumerate(LIMBS) if name.startswith("left_") and name[5:] in ARM]
    upper = [i + 1 for i, name in enumerate(LIMBS) if not name.endswith(("pelvis", "thigh", "shin", "foot"))]
    for i, gone in ((1, arm), (2, upper)):
        assert not np.isin(part.limbs[i], gone).any()
        stays = (all_limbs.limbs[i] > 0) & ~np.isin(all_limbs.limbs[i], gone)
        np.testing.assert_array_equal(part.limbs[i][stays], all_limbs.limbs[i][stays])
        np.testing.assert_array_equal(part.depth[i][stays], all_limbs.depth[i][stays])
    assert not part.limbs[3].any()
    assert np.isinf(part.depth[3]).all()
    if scene.samples == 1:
        same = (part.limbs[2] > 0) & (part.limbs[2] == all_limbs.limbs[2])
        np.testing.assert_array_equal(part.rgb[2][same], all_limbs.rgb[2][same])
