"""Many different bodies at a time: what the raycaster draws of each, whatever the batch and the threads."""

import pickle

import numpy as np
import pytest

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.render import Raycaster, Scene
from motionenv.render.cameras import look_at
from motionenv.render.raycast.multi_body import WORN, MultiBodyRaycaster
from motionenv.types import Frame

WIDTH, HEIGHT = 60, 52


def people(walking, n=40, seed=3, width=WIDTH, height=HEIGHT):
    """Poses, skeletons, clothes and cameras of n different people."""
    rng = np.random.default_rng(seed)
    skeletons = [from_height(rng.uniform(1.4, 2.1), girth=rng.uniform(0.7, 1.4)) for _ in range(n)]
    cameras = [
        look_at(
            (rng.uniform(1.5, 5) * np.sin(a), rng.uniform(1.5, 5) * np.cos(a), rng.uniform(0.2, 3)),
            rng.normal((0, 0, 0.9), 0.2),
            width=width, height=height, fov_degrees=rng.uniform(25, 60),
        )
        for a in rng.uniform(-np.pi, np.pi, n)
    ]  # fmt: skip
    return walking(n, seed), skeletons, rng.uniform(0, 1, (n, 5, 3)), cameras


def arguments(poses, skeletons, colours, cameras):
    """The same as arrays, in the order of `MultiBodyRaycaster.render`."""
    bodies = [np.array([getattr(s, name) for s in skeletons]) for name in ("offsets", "radii", "height")]
    return poses, *bodies, colours, *[np.array([getattr(c, name) for c in cameras]) for name in ("K", "R", "t")]


def same(a: Frame, b: Frame) -> None:
    np.testing.assert_array_equal(a.depth, b.depth)
    np.testing.assert_array_equal(a.limbs, b.limbs)
    np.testing.assert_array_equal(a.rgb, b.rgb)


def test_each_picture_is_what_the_raycaster_draws_without_ground(walking):
    """People at 1.5 to 7 m, some of them cut by the picture's edges."""
    poses, skeletons, colours, cameras = people(walking)
    drawn = MultiBodyRaycaster(WIDTH, HEIGHT).render(*arguments(poses, skeletons, colours, cameras))
    seen = 0
    for i, (pose, skeleton, worn, camera) in enumerate(zip(poses, skeletons, colours, cameras, strict=True)):
        scene = Scene(ground=False, **dict(zip(WORN, map(tuple, worn), strict=True)))
        alone = Raycaster(scene).render(pose, skeleton, camera)
        np.testing.assert_array_equal(drawn.depth[i], alone.depth)
        np.testing.assert_array_equal(drawn.limbs[i], alone.limbs)
        body = alone.limbs > 0
        np.testing.assert_array_equal(drawn.rgb[i][body], alone.rgb[body])
        assert not drawn.rgb[i][~body].any()
        seen += body.sum()
    assert seen > 40 * 100


@pytest.mark.parametrize("threads", [2, 3])
def test_same_bits_whatever_the_batch_and_the_threads(threads, walking):
    given = arguments(*people(walking))
    one = MultiBodyRaycaster(WIDTH, HEIGHT).render(*given)
    crowd = MultiBodyRaycaster(WIDTH, HEIGHT, threads=threads)
    same(one, crowd.render(*given))
    parts = [crowd.render(*(a[at] for a in given)) for at in (slice(0, 1), slice(1, 8), slice(8, 40))]
    same(one, Frame(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("rgb", "depth", "limbs"))))


def test_without_colours_depth_and_limbs_are_the_same(walking):
    given = arguments(*people(walking, 5))
    crowd = MultiBodyRaycaster(WIDTH, HEIGHT)
    full, bare = crowd.render(*given), crowd.render(*given, rgb=False)
    assert bare.rgb is None
    np.testing.assert_array_equal(full.depth, bare.depth)
    np.testing.assert_array_equal(full.limbs, bare.limbs)


def test_pictures_are_new_unless_out_is_given(walking):
    first, second = arguments(*people(walking, 4)), arguments(*people(walking, 4, seed=9))
    crowd = MultiBodyRaycaster(WIDTH, HEIGHT)
    a, b = crowd.render(*first), crowd.render(*second)
    for name in ("rgb", "depth", "limbs"):
        assert not np.shares_memory(getattr(a, name), getattr(b, name))
    assert crowd.render(*second, out=a) is a
    same(a, b)
    with pytest.raises(MotionError, match=r"out\.rgb must be None"):
        crowd.render(*second, rgb=False, out=a)
    with pytest.raises(MotionError, match=r"out\.depth must be .* \(4, 52, 60\)"):
        crowd.render(*second, out=Frame(a.rgb, a.depth.astype(np.float64), a.limbs))


def test_nobody_makes_no_pictures(walking):
    frame = MultiBodyRaycaster(WIDTH, HEIGHT, threads=2).render(*(a[:0] for a in arguments(*people(walking, 1))))
    assert frame.rgb.shape == (0, HEIGHT, WIDTH, 3)


def test_a_used_crowd_survives_pickling(walking):
    given = arguments(*people(walking, 6))
    crowd = MultiBodyRaycaster(WIDTH, HEIGHT, scene=Scene(key=(1, 0, 1)), threads=2)
    before = crowd.render(*given)
    copy = pickle.loads(pickle.dumps(crowd))
    assert copy.threads == 2
    same(before, copy.render(*given))


@pytest.mark.parametrize(
    ("which", "bad", "message"),
    [
        (0, np.zeros((3, 24)), r"poses must have shape \(3, 25\), got \(3, 24\)"),
        (0, np.zeros(25), r"poses must have shape"),
        (0, np.full((3, 25), np.nan), r"poses\[0, 0\] is nan"),
        (1, np.zeros((2, 16, 3)), r"offsets must have shape \(3, 16, 3\)"),
        (2, np.zeros((3, 12, 2)), r"radii must have shape \(3, 22, 2\)"),
        (3, np.array([1.7, np.inf, 1.8]), r"heights\[1\] is inf"),
        (4, np.zeros((3, 3, 3)), r"colours must have shape \(3, 5, 3\)"),
        (5, np.full((3, 3, 3), np.nan), r"K\[0, 0, 0\] is nan"),
        (5, np.zeros((3, 3, 3)), "K must hold invertible matrices"),
        (6, np.zeros((3, 3)), r"R must have shape \(3, 3, 3\)"),
        (7, np.zeros((3, 4)), r"t must have shape \(3, 3\)"),
    ],
)
def test_refuses_what_it_cannot_draw(which, bad, message, walking):
    given = list(arguments(*people(walking, 3)))
    given[which] = bad
    with pytest.raises(MotionError, match=message):
        MultiBodyRaycaster(WIDTH, HEIGHT).render(*given)


@pytest.mark.parametrize(
    ("bad", "message"),
    [({"width": 0}, "width"), ({"height": 2.5}, "height"), ({"threads": 0}, "threads"), ({"threads": True}, "threads")],
)
def test_refuses_impossible_settings(bad, message):
    with pytest.raises(MotionError, match=message):
        MultiBodyRaycaster(**{"width": 64, "height": 64, **bad})
