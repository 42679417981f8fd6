"""Where tracks begin without being told: heading, phase and place from the first pictures."""

import numpy as np
import pytest
from scipy.stats import norm

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.models.paths import WalkPath
from motionenv.models.people import draw_person
from motionenv.models.registry import load
from motionenv.models.synthesis import synthesize
from motionenv.render import render
from motionenv.render.cameras import look_at, view
from motionenv.tracking.initialization import _log_sizes, automatic_start, bounding_boxes


def pictures(alpha: float, seed: int, frames: int = 10):
    """Masks of somebody who walks along x, his poses and body, and a likelihood that knows the camera."""
    walk = synthesize("walk/fpca", 1, 30, seed=seed, height=1.7)
    camera = view(alpha, width=96, height=96, distance=4.5)
    masks = render(walk.poses[:frames], walk.skeleton, camera).limbs > 0
    return [{"mask": m} for m in masks], walk, SilhouetteLikelihood(camera, walk.skeleton, threads=1)


@pytest.mark.parametrize("degrees", [0, 40, 90, 160, -120])
def test_the_truth_is_among_the_candidates_whatever_the_view(degrees):
    observations, walk, likelihood = pictures(np.radians(degrees), seed=degrees + 400)
    start = automatic_start(likelihood, observations, n=3000, seed=1)
    off = markers(start.poses, walk.skeleton) - markers(walk.poses[0], walk.skeleton)
    error = np.linalg.norm(off, axis=-1).mean(axis=-1)
    assert error.min() < 0.1
    near = start.poses[error < 0.15]
    turned = np.degrees(np.angle(np.exp(1j * (near[:, 5] - walk.poses[0, 5]))))
    assert np.abs(turned).max() < 40
    assert start.previous[error.argmin(), 0] < start.poses[error.argmin(), 0]


def test_somebody_who_walks_round_a_curve_is_found_with_his_first_heading():
    """Over a second he turns by 57°; from straight walks alone, his first heading would be off by half of that."""
    walk = synthesize("walk/fpca", 1, 30, seed=12, height=1.7, speed=1.2, path=WalkPath.arc(1.2, 2.0))
    camera = view(np.radians(60), width=96, height=96, distance=5.0)
    masks = render(walk.poses, walk.skeleton, camera).limbs > 0
    likelihood = SilhouetteLikelihood(camera, walk.skeleton, threads=1)
    start = automatic_start(likelihood, [{"mask": m} for m in masks], n=4000, seed=1)
    off = np.degrees(np.angle(np.exp(1j * (start.poses[:, 5] - walk.poses[0, 5]))))
    assert np.abs(np.median(off)) < 15
    joints = markers(start.poses, walk.skeleton) - markers(walk.poses[0], walk.skeleton)
    assert np.median(np.linalg.norm(joints, axis=-1).mean(axis=-1)) < 0.2  # candidates' distances vary by 3 % of 5 m


def test_somebody_who_walks_to_the_left_is_found_to():
    walk = synthesize("walk/fpca", 1, 30, seed=9)
    turned = walk.poses[:10].copy()
    turned[:, :2] *= -1
    turned[:, 5] += np.pi
    camera = view(0.0, width=96, height=96)
    masks = render(turned, walk.skeleton, camera).limbs > 0
    start = automatic_start(
        SilhouetteLikelihood(camera, walk.skeleton, threads=1), [{"mask": m} for m in masks], seed=0
    )
    assert (np.cos(start.poses[:, 5]) < -0.8).mean() > 0.9


@pytest.mark.parametrize("height", [1.5, 1.95])
def test_the_feet_tell_how_far_away_somebody_of_unknown_size_is(height):
    walk = synthesize("walk/fpca", 1, 30, seed=3, height=height)
    camera = view(0.0, width=96, height=96, distance=5.0)
    masks = render(walk.poses[:10], walk.skeleton, camera).limbs > 0
    likelihood, seen = SilhouetteLikelihood(camera, threads=1), [{"mask": m} for m in masks]
    start = automatic_start(likelihood, seen, n=3000, size=0.07, seed=1)
    assert abs(np.median(start.heights) / height - 1) < 0.03
    away = (np.median(start.poses[:, :3], axis=0) - walk.poses[0, :3]) @ camera.R[2]
    assert abs(away) < 0.25  # of 5 m: heads of small people are large


def test_a_child_whose_feet_show_is_no_adult_farther_away():
    walk = synthesize("walk/fpca", 1, 30, seed=3, height=1.2)
    camera = view(0.0, width=64, height=64, distance=5.0)
    masks = render(walk.poses[:4], walk.skeleton, camera).limbs > 0
    likelihood, seen = SilhouetteLikelihood(camera, threads=1), [{"mask": m} for m in masks]
    starts = [automatic_start(likelihood, seen, n=3000, size=0.06, children=c, seed=1) for c in (0.15, 0.0)]
    off = [(np.median(start.poses[:, :3], axis=0) - walk.poses[0, :3]) @ camera.R[2] for start in starts]
    assert abs(np.median(starts[0].heights) / 1.2 - 1) < 0.05
    assert abs(off[0]) < 0.3 < off[1]  # [m] of 5


def test_sizes_are_those_of_adults_and_of_the_populations_children():
    rng, logs = np.random.default_rng(0), np.linspace(-0.5, 0.25, 7)
    adults, children = (
        np.array([draw_person(rng, person=kind).height for _ in range(4000)]) for kind in ("adult", "child")
    )
    young = np.log(children / adults.mean())
    both = 0.85 * norm.pdf(logs, 0, 0.06) + 0.15 * norm.pdf(logs, young.mean(), young.std())
    density = _log_sizes(logs, 0.06, 0.15)
    np.testing.assert_allclose(density - density[4], np.log(both / both[4]), atol=0.3)
    np.testing.assert_allclose(_log_sizes(logs, 0.06, 0.0), norm.logpdf(logs, 0, 0.06) - norm.logpdf(0, 0, 0.06))


def cut(mask, rows):
    """A mask of which something hides rows, from one share of the body's height to another."""
    hidden, (v, _) = mask.copy(), np.nonzero(mask)
    first, last = (round(v.min() + share * (np.ptp(v) + 1)) for share in rows)
    hidden[first:last] = False
    return hidden


@pytest.mark.parametrize("rows", [(0.55, 1.0), (0.0, 0.5)], ids=["legs", "upper half"])
def test_somebody_of_whom_a_part_is_hidden_is_not_taken_for_small_and_far(rows):
    """If all hypotheses filled what is seen, he would be found 3.5 and 2 m too far away."""
    walk = synthesize("walk/fpca", 1, 30, seed=3, height=1.7)
    camera = view(0.0, width=96, height=96, distance=5.0)
    masks = [cut(mask, rows) for mask in render(walk.poses[:10], walk.skeleton, camera).limbs > 0]
    likelihood = SilhouetteLikelihood(camera, walk.skeleton, misses=0.49, false_alarms=0.02, threads=1)
    start = automatic_start(likelihood, [{"mask": m} for m in masks], n=4000, size=0.06, seed=1)
    away = (np.median(start.poses[:, :3], axis=0) - walk.poses[0, :3]) @ camera.R[2]
    assert abs(away) < 0.7  # of 5 m


@pytest.mark.parametrize("hidden", [None, 0.9])
def test_a_sliver_beside_a_post_is_a_hidden_person_only_for_who_expects_posts(hidden):
    """Two columns of a person: somebody small who fills them, unless what stands before the rest costs nothing."""
    walk = synthesize("walk/fpca", 1, 30, seed=3, height=1.7)
    camera = view(0.0, width=64, height=64, distance=5.0)
    masks = render(walk.poses[:4], walk.skeleton, camera).limbs > 0
    first = np.nonzero(masks[0].any(axis=0))[0][0] + 3
    masks[:, :, first:] = False
    likelihood = SilhouetteLikelihood(camera, walk.skeleton, misses=0.49, false_alarms=0.02, hidden=hidden, threads=1)
    start = automatic_start(likelihood, [{"mask": m} for m in masks], n=4000, size=0.06, seed=1)
    away = np.median((start.poses[:, :3] - walk.poses[0, :3]) @ camera.R[2])
    assert abs(away) < 0.5 if hidden else away > 5.0  # [m] of 5


def test_a_known_place_decides_where_pictures_do_not():
    """Somebody of unknown size, whose feet are hidden, is where he may be: the picture fits at 4.5 and at 6 m."""
    walk = synthesize("walk/fpca", 1, 30, seed=3, height=1.7)
    camera = view(0.0, width=96, height=96, distance=5.0)
    mask = cut(render(walk.poses[:1], walk.skeleton, camera).limbs[0] > 0, (0.5, 1.0))
    likelihood = SilhouetteLikelihood(camera, walk.skeleton, misses=0.49, false_alarms=0.02, threads=1)
    for far in (4.5, 6.0):
        start = automatic_start(
            likelihood, [{"mask": mask}], n=2000, size=0.2, seed=1,
            place=lambda at, sizes, far=far: -0.5 * ((np.hypot(*(at - camera.centre[:2]).T) - far) / 0.05) ** 2,
        )  # fmt: skip
        assert np.median(np.hypot(*(start.poses[:, :2] - camera.centre[:2]).T)) == pytest.approx(far, abs=0.15)


def test_somebody_cut_by_the_edge_of_the_picture_is_as_near_as_he_is():
    walk = synthesize("walk/fpca", 1, 30, seed=3, height=1.7)
    camera = look_at((0.0, -2.4, 1.0), (0.3, 0.0, 0.9), width=96, height=96, fov_degrees=30.0)
    masks = render(walk.poses[:10], walk.skeleton, camera).limbs > 0
    assert masks[0][0].any()
    assert masks[0][-1].any()
    likelihood = SilhouetteLikelihood(camera, walk.skeleton, threads=1)
    start = automatic_start(likelihood, [{"mask": m} for m in masks], n=4000, size=0.06, seed=1)
    away = (np.median(start.poses[:, :3], axis=0) - walk.poses[0, :3]) @ camera.R[2]
    assert abs(away) < 0.4


def test_the_seed_says_all_whatever_the_threads():
    observations, walk, likelihood = pictures(0.3, seed=4, frames=3)
    other = SilhouetteLikelihood(likelihood.camera, walk.skeleton, threads=3)
    one, two = (automatic_start(m, observations, n=500, candidates=7, seed=5) for m in (likelihood, other))
    assert one.poses.shape == (7, 25)
    np.testing.assert_array_equal(one.poses, two.poses)
    np.testing.assert_array_equal(one.previous, two.previous)


def test_a_likelihood_that_learns_the_background_learns_nothing_from_the_search():
    _, walk, _ = pictures(0.3, seed=4)
    camera = view(0.3, width=96, height=96, distance=4.5)
    films = [{"rgb": p} for p in render(walk.poses[:3], walk.skeleton, camera).rgb]
    likelihood, other = (SilhouetteLikelihood(camera, walk.skeleton, threads=1) for _ in range(2))
    for model in (likelihood, other):
        model.observe(**films[0])
    automatic_start(likelihood, films, n=300, candidates=7, seed=5)
    for picture in films[1:] * 4:
        likelihood.observe(**picture)
        other.observe(**picture)
    np.testing.assert_array_equal(likelihood.foreground, other.foreground)


def test_the_box_leaves_specks_out_and_keeps_what_an_occluder_parts():
    mask = np.zeros((40, 30))
    mask[5:15, 10:14] = mask[20:35, 11:16] = 1
    mask[38, 28] = 1
    np.testing.assert_array_equal(bounding_boxes(mask)[0], [10, 15, 5, 34])
    np.testing.assert_array_equal(bounding_boxes(mask)[1:], [[10, 13, 5, 14], [11, 15, 20, 34]])
    assert len(bounding_boxes(mask[:18])) == 1


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"observations": []}, "at least one"),
        ({"observations": [{"mask": np.zeros((96, 96), dtype=bool)}]}, "no foreground"),
        ({"n": 10}, "whole number from 100"),
        ({"candidates": 0}, "candidates"),
        ({"fps": -1}, "fps"),
        ({"model": load("walk/prior")}, "WalkingModel"),
    ],
)
def test_what_can_not_be_is_refused(change, says):
    observations, _, likelihood = pictures(0.0, seed=1, frames=1)
    arguments = {"likelihood": likelihood, "observations": observations} | change
    with pytest.raises(MotionError, match=says):
        automatic_start(arguments.pop("likelihood"), arguments.pop("observations"), **arguments)
