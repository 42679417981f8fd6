from dataclasses import replace

import numpy as np
import pytest
from scipy.special import softmax

from motionenv.body import mirror
from motionenv.errors import ModelError, MotionError
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.models.motion_tree.features import PARTS, local, parameters, placed
from motionenv.models.motion_tree.model import MotionTree
from motionenv.models.transforms import scaled
from motionenv.types import Motion


def test_windows_keep_their_coefficients(tree, database):
    for window in (0, 31, 32, len(tree.frames_) - 1):
        last = tree.frames_[window]
        first = database.starts[database.sequence_of(last)]
        history = database.poses[first : last + 1]
        np.testing.assert_allclose(tree.index_.coefficients([window])[0], tree.coefficients(history), atol=1e-3)


def test_what_follows_is_the_pose_after_the_window(tree, database, stranger):
    drawn = tree.sample(stranger, 50, seed=1, temperature=0.5)
    frames = tree.frames_[drawn.windows]
    after = local(database.poses[frames], database.poses[frames + 1])
    np.testing.assert_allclose(drawn.poses, placed(stranger.poses[-1], after), atol=1e-6)
    assert (database.sequence_of(frames) == database.sequence_of(frames + 1)).all()


@pytest.mark.parametrize("method", ["tree", "exact"])
def test_at_low_temperature_a_window_of_the_database_goes_on_as_it_did(tree, database, method):
    history = database.motion(3).poses[20:50]
    drawn = tree.sample(history, 20, temperature=1e-7, seed=0, method=method, leaf="kernel")
    assert (tree.source(drawn.windows) == 3).mean() > (0.9 if method == "exact" else 0.5)
    found = tree.source(drawn.windows) == 3
    assert np.abs(drawn.poses[found] - database.motion(3).poses[50]).max() < 1e-4


def test_said_probabilities_of_exact_draws_are_those_of_the_formula(tree, stranger):
    drawn = tree.sample(stranger, 30, temperature=0.3, seed=2, method="exact")
    every = tree.index_.coefficients(np.arange(len(tree.frames_))).astype(float)
    wanted = softmax(-0.5 * ((every - tree.coefficients(stranger)) ** 2).sum(1) / 0.3)
    np.testing.assert_allclose(np.exp(drawn.log_probability), wanted[drawn.windows], rtol=0.011)


def test_place_heading_size_and_whole_turns_do_not_matter(tree, stranger):
    plain = tree.sample(stranger, 5, seed=3)
    elsewhere = stranger.poses.copy()
    elsewhere[:, :2] = stranger.poses[:, :2] @ [[0, 1], [-1, 0]] + [7, -2]
    elsewhere[:, 5] += np.pi / 2
    elsewhere[:, 9] += 2 * np.pi
    moved = tree.sample(elsewhere, 5, seed=3)
    np.testing.assert_array_equal(moved.windows, plain.windows)
    np.testing.assert_allclose(moved.poses[:, 9], plain.poses[:, 9] + 2 * np.pi, atol=1e-6)
    np.testing.assert_allclose(moved.poses[:, 5], plain.poses[:, 5] + np.pi / 2, atol=1e-6)
    tall = scaled(Motion(stranger.poses, tree.database_.skeleton, 30.0), 1.95)
    grown = tree.sample(tall, 5, seed=3)
    np.testing.assert_array_equal(grown.windows, plain.windows)
    np.testing.assert_allclose(
        grown.poses[:, :3], plain.poses[:, :3] * 1.95 / tree.database_.skeleton.height, atol=1e-5
    )


def test_a_batch_of_histories_is_each_of_them(tree, stranger):
    histories = np.stack([stranger.poses[t : t + 12] for t in range(0, 60, 5)]).reshape(3, 4, 12, 25)
    drawn = tree.sample(histories, 7, seed=4)
    assert drawn.poses.shape == (3, 4, 7, 25)
    one = tree.sample(histories[0, 0], 7, seed=4)
    np.testing.assert_array_equal(one.windows, drawn.windows[0, 0])


def test_noise_is_a_share_of_the_predictions_error(tree, stranger):
    quiet = tree.sample(stranger, 4000, seed=5, temperature=0.2)
    noisy = tree.sample(stranger, 4000, seed=5, temperature=0.2, noise=0.5)
    np.testing.assert_array_equal(noisy.windows, quiet.windows)
    spread = local(stranger.poses[-1], noisy.poses) - local(stranger.poses[-1], quiet.poses)
    np.testing.assert_allclose(spread.std(0), 0.5 * tree.forecast_.plain_deviation, rtol=0.06)


def test_carrying_over_predicts_strangers_better(tree, stranger):
    histories = np.stack([stranger.poses[t - 12 : t] for t in range(12, 110, 3)])
    truth = np.stack([stranger.poses[t] for t in range(12, 110, 3)])
    errors = []
    for carry in (False, True):
        poses = tree.sample(histories, 20, seed=6, method="exact", carry=carry).poses
        errors.append(np.sqrt(((poses - truth[:, None]) ** 2).mean((0, 1))))
    assert np.median(errors[1] / errors[0]) < 0.5


@pytest.mark.parametrize("part", ["lower", "upper", "left_arm", "right_arm"])
def test_a_part_of_the_body_moves_alone(database, stranger, part):
    tree = MotionTree(part=part).fit_database(database)
    drawn = tree.sample(stranger, 10, seed=1)
    others = [i for i in range(25) if i not in PARTS[part]]
    np.testing.assert_array_equal(
        drawn.poses[:, others], np.broadcast_to(stranger.poses[-1, others], (10, len(others)))
    )
    own = list(PARTS[part])
    assert np.abs(drawn.poses[:, own] - stranger.poses[-1, own]).max() > 1e-3
    other = stranger.poses.copy()
    other[:, others] = mirror(stranger.poses)[:, others] if part in ("lower", "upper") else 0.0
    np.testing.assert_array_equal(tree.sample(other, 10, seed=1).windows, drawn.windows)


def test_same_database_same_tree(database, tree, stranger):
    again = MotionTree().fit_database(database)
    for name, value in tree.to_arrays()[0].items():
        np.testing.assert_array_equal(again.to_arrays()[0][name], value, err_msg=name)
    np.testing.assert_array_equal(tree.sample(stranger, seed=1).poses, again.sample(stranger, seed=1).poses)


def test_options_are_checked_whatever_the_method(tree, stranger):
    with pytest.raises(MotionError, match="leaf must be"):
        tree.sample(stranger, method="exact", leaf="kernle")
    with pytest.raises(MotionError, match="method must be"):
        tree.draw(tree.coefficients(stranger)[None], 1, 0.1, 0, "exakt", "uniform")
    with pytest.raises(MotionError, match="history must be numeric"):
        tree.sample("walk")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_database_with_gaps_is_refused(tree, bad):
    poses = tree.database_.poses.copy()
    poses[40, 20] = bad
    with pytest.raises(MotionError, match="poses must be finite"):
        MotionTree().fit_database(replace(tree.database_, poses=poses))


@pytest.mark.parametrize("method", ["tree", "exact"])
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"temperature": 0.0}, r"beta \(temperature\) must be a number above 0, got 0.0"),
        ({"temperature": "hot"}, "beta .*'hot'"),
        ({"probes": np.zeros((4, 2))}, r"probes must have shape .*got \(4, 2\)"),
        ({"probes": np.nan}, "probes must be finite"),
        ({"probes": 1e20}, "probes must be finite"),
    ],
)
def test_draws_that_make_no_sense_are_refused(tree, stranger, method, change, says):
    right = {"probes": tree.coefficients(stranger)[None], "n": 1, "temperature": 0.1, "key": 1, "leaf": "uniform"}
    if isinstance(bad := change.get("probes"), float):
        change = {"probes": np.full_like(right["probes"], bad)}
    with pytest.raises(MotionError, match=says):
        tree.draw(**(right | change), method=method)


def test_a_single_window_is_a_database_too(stranger):
    """A history can only go on as it does."""
    tree = MotionTree().fit_database(build_database([Clip(Motion(stranger.poses[:11], stranger.skeleton, 30.0))]))
    assert 0 <= tree.basis_.share <= 1
    again = MotionTree.from_arrays(*tree.to_arrays())
    np.testing.assert_allclose(again.sample(stranger, 3, noise=0).log_probability, 0.0, atol=1e-12)
    drawn = tree.sample(stranger, 3, seed=1, method="exact")
    assert (drawn.windows == 0).all()
    np.testing.assert_allclose(drawn.log_probability, 0, atol=0.01)
    step = parameters(stranger.poses)[10, :25]
    np.testing.assert_allclose(local(stranger.poses[-1], drawn.poses[0]), step, atol=1e-5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"temperature": 0}, "0"),
        ({"temperature": np.nan}, "nan"),
        ({"n": 0}, "n must be a whole number of draws from 1, got 0"),
        ({"n": 2.5}, "got 2.5"),
        ({"n": True}, "n must be a whole number"),
        ({"n": None}, "n must be a whole number"),
        ({"noise": -1}, "noise must be .*, got -1"),
        ({"method": "guess"}, "method must be 'tree' or 'exact', got 'guess'"),
        ({"leaf": "first"}, "first"),
    ],
)
def test_bad_options_are_named(tree, stranger, options, message):
    with pytest.raises(MotionError, match=message):
        tree.sample(stranger, **options)


def test_bad_settings_and_unfitted_trees():
    with pytest.raises(MotionError, match="part must be one of body, .* got 'tail'"):
        MotionTree(part="tail")
    with pytest.raises(MotionError, match="splits must be"):
        MotionTree(splits="even")
    with pytest.raises(ModelError, match="not fitted"):
        MotionTree().coefficients(np.zeros((10, 25)))


def test_a_database_larger_than_memory_gives_the_same_tree(database, tree, stranger, monkeypatch):
    """With the coefficients in a file, whose size is bounded by nothing but the disk."""
    monkeypatch.setattr("motionenv.models.motion_tree.model._IN_MEMORY", 1000)
    mapped = MotionTree().fit_database(database)
    for name, value in tree.to_arrays()[0].items():
        np.testing.assert_array_equal(mapped.to_arrays()[0][name], value, err_msg=name)


def test_motions_may_come_one_by_one(stranger):
    parts = [Motion(stranger.poses[i : i + 30], stranger.skeleton, 30.0) for i in range(3)]
    tree = MotionTree().fit((part for part in parts), "abc")
    assert tree.database_.persons == ("a", "b", "c")
    for labels, said in (("ab", "got 2 and more motions"), ("abcd", "got 3 motions and 4 subjects")):
        with pytest.raises(MotionError, match=said):
            MotionTree().fit(iter(parts), labels)
