"""Walkers in the state space of paper A: moments in closed form, and the model's own synthesis."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from motionenv.body import NODES, feet, markers
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import MotionError
from motionenv.models.paths.bending import TURN_MEMORY, TURN_RATE
from motionenv.models.registry import load
from motionenv.models.walking.model import WalkerScores
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior, Start
from motionenv.tracking.priors._walk_kernel import CHANGING, EASE, HEADING, PACE, PHASE, TURN, TURNING, X, Y
from motionenv.tracking.priors.fpca import _CHANGES, _LEGS, _PACE, _REST, _TURNS

SHAPED = _REST > 0


@pytest.fixture(scope="module")
def model():
    return load("walk/fpca")


@pytest.fixture(scope="module")
def prior(model):
    return FPCAPrior(model)


def mean_walk(model, prior, fps: float, seconds: float = 3.0) -> np.ndarray:
    """Poses (frames, 25) of the model's mean walker."""
    stride = WalkerScores(model.person_mean_[None, :-2], np.exp(model.person_mean_[-2:-1]))
    return model.walks(seconds, fps, n=1, stride=stride, variation=0.0, skeleton=prior.skeleton).poses[0]


@pytest.mark.slow
@pytest.mark.parametrize("fps", [30.0, 120.0, 12.5])
def test_the_mean_of_the_particles_follows_the_models_own_synthesis(model, fps):
    prior = FPCAPrior(model, fps=fps)
    prior.deviation[27:] = 0.0  # nobody turns or slows down
    walk = mean_walk(model, prior, fps)
    rng = np.random.default_rng(0)
    state = prior.initial(Start.at(walk[0], spread=0.0), 4000, rng)
    quiet = state.gait[:1].copy()
    state.scores[:], state.rest[:], state.gait[:] = 0.0, 0.0, quiet
    state.gait[:, PACE] = -model.person_mean_[-2]
    state.gait[:, PHASE] = state.gait[:, X] = state.gait[:, Y] = state.gait[:, HEADING] = state.gait[:, TURN] = 0.0
    frames = int(0.8 * fps)
    for _ in range(frames):
        state = prior.propagate(state, rng)
    mean = markers(state.poses, prior.skeleton).mean(0)
    truth = markers(walk[frames], prior.skeleton)
    assert np.linalg.norm(mean - truth, axis=1).mean() < 0.03
    assert truth[2, 0] > 0.7


@pytest.mark.parametrize("legs", [0.94, 1.06])
def test_long_and_short_legs_stand_on_the_ground(model, legs):
    body = model.skeleton()
    offsets = body.offsets.copy()
    offsets[[i for i, name in enumerate(NODES) if name.endswith(("knee", "ankle"))]] *= legs
    prior = FPCAPrior(model, skeleton=replace(body, offsets=offsets))
    ankles, _ = feet(prior.table[:, 0], prior.skeleton)
    lowest = ankles[..., 2].min(axis=1) - ANKLE_HEIGHT * body.height
    assert abs(lowest.min()) < 0.01  # until the heel rises; 6 % of the legs are 5 cm
    assert np.median(lowest) < 0.02


def test_the_spread_settles_to_that_of_the_model_whatever_the_frame_rate(model):
    rng = np.random.default_rng(1)
    for fps, frames in ((30.0, 250), (10.0, 90)):
        prior = FPCAPrior(model, fps=fps)
        state = prior.initial(Start.at(mean_walk(model, prior, 30)[9]), 6000, rng)
        for _ in range(frames):
            state = prior.propagate(state, rng)
        q = model.fpca_.n_components
        wanted = model.person_covariance_[:q, :q] + model.cycle_covariance_
        scale = np.sqrt(np.diag(wanted))
        np.testing.assert_allclose(np.cov(state.scores.T) / np.outer(scale, scale), wanted / np.outer(scale, scale),
                                   atol=0.08)  # fmt: skip
        np.testing.assert_allclose(state.rest.std(0)[SHAPED], _REST[SHAPED], rtol=0.05)
        assert (state.rest[:, ~SHAPED] == 0).all()
        assert state.gait[:, PACE].std() == pytest.approx(_PACE, rel=0.05)
        assert state.gait[:, PACE].mean() == pytest.approx(-model.person_mean_[q], abs=0.01)


def test_a_step_has_the_noise_that_the_settings_state(prior, model):
    """Moments of many steps from one state: autoregressive pace, scores and deviations, a random walk's heading."""
    before = prior.initial(Start.at(mean_walk(model, prior, 30)[4]), 1, np.random.default_rng(2))
    before.gait[:, [TURNING, CHANGING]], before.gait[:, TURN] = 1.0, 0.3
    prior = copy(prior)
    prior._step = np.concatenate([prior._step[:17], np.zeros(4)])  # nobody stops turning or changing speed
    after = prior.propagate(before.take(np.zeros(20_000, dtype=int)), np.random.default_rng(3))
    a, b, dt = before.gait[0], after.gait, 1 / 30
    keep = np.exp(-dt / np.array([2.0, 1.5, 0.5]))
    wide = np.sqrt(1 - keep**2)
    pace = -model.person_mean_[model.fpca_.n_components]
    assert b[:, PACE].mean() == pytest.approx(pace + keep[0] * (a[PACE] - pace), abs=4e-4)
    assert b[:, PACE].std() == pytest.approx(wide[0] * _PACE, rel=0.03)
    assert b[:, TURN].mean() == pytest.approx(np.exp(-dt / TURN_MEMORY) * a[TURN], abs=0.004)
    assert b[:, TURN].std() == pytest.approx(TURN_RATE * np.sqrt(1 - np.exp(-2 * dt / TURN_MEMORY)), rel=0.03)
    assert (b[:, HEADING] - a[HEADING] - dt * b[:, TURN]).std() == pytest.approx(0.02, rel=0.03)
    slower = np.sqrt(np.clip(b[:, EASE], 0, 1))
    assert (b[:, PHASE] - np.exp(b[:, PACE]) * slower * dt - a[PHASE]).std() == pytest.approx(0.003, rel=0.03)
    covariance = wide[1] ** 2 * prior._covariance
    np.testing.assert_allclose(
        after.scores.mean(0), keep[1] * before.scores[0], atol=4 * np.sqrt(covariance.max() / 2e4)
    )
    np.testing.assert_allclose(after.scores.std(0), np.sqrt(np.diag(covariance)), rtol=0.04)
    np.testing.assert_allclose(after.rest.std(0)[SHAPED], (wide[2] * _REST)[SHAPED], rtol=0.04)


def test_turns_and_changes_of_speed_begin_and_end_at_their_rates_and_nothing_turns_outside_of_them(prior, model):
    """Shares a second after "none", by the closed form of a chain of two states; who doesn't turn goes straight."""
    state = prior.initial(Start.at(mean_walk(model, prior, 30)[4]), 20_000, np.random.default_rng(2))
    for column, (begins, ends) in ((TURNING, _TURNS), (CHANGING, _CHANGES)):
        assert state.gait[:, column].mean() == pytest.approx(begins / (begins + ends), abs=0.015)
    state.gait[:, [TURNING, CHANGING, TURN]], rng = 0.0, np.random.default_rng(3)
    for _ in range(30):
        before, state = state, prior.propagate(state, rng)
    for column, (begins, ends) in ((TURNING, _TURNS), (CHANGING, _CHANGES)):
        wanted = begins / (begins + ends) * (1 - np.exp(-(begins + ends)))
        assert state.gait[:, column].mean() == pytest.approx(wanted, abs=4 * np.sqrt(wanted / 20_000) + 0.003)
    straight, even = state.gait[:, TURNING] == 0, state.gait[:, CHANGING] == 0
    assert (state.gait[straight, TURN] == 0).all()
    assert (state.gait[~straight, TURN] != 0).all()
    assert (state.gait[even, EASE] == before.gait[even, EASE]).all()


def quiet(model, turn: float, ease: float):
    """A prior without noise that moves anything, and the state of its mean walker with a turning rate and a speed."""
    prior = FPCAPrior(model, fps=100.0)
    state = prior.initial(Start.at(mean_walk(model, prior, 30)[4], spread=0.0), 1, np.random.default_rng(7))
    state.scores[:], state.rest[:] = 0.0, 0.0
    state.gait[:, [X, Y, HEADING, TURN, EASE, TURNING, CHANGING]] = 0.0, 0.0, 0.0, turn, ease, 1.0, 1.0
    prior._step[[1, 2, 3, 12, 13]], prior._step[[*range(4, 11), *range(15, 21)]] = 1.0, 0.0
    return prior, prior.posed(state.gait, state.scores, state.rest)


def test_who_turns_at_an_even_rate_goes_round_a_circle_and_leans_in_as_bent_walks_do(model):
    """After a whole turn he is back, and half-way as far away as the circle is wide: circumference over pi."""
    prior, state = quiet(model, 0.8, 2.0)
    rng, way, lean = np.random.default_rng(8), [state.poses[0, :2]], []
    for _ in range(round(100 * 2 * np.pi / 0.8)):
        state = prior.propagate(state, rng)
        way.append(state.poses[0, :2])
        lean.append(state.poses[0, 4])
    way = np.array(way)
    circumference = np.linalg.norm(np.diff(way[::25], axis=0), axis=1).sum()
    assert np.linalg.norm(way[-1] - way[0]) < 0.02 * circumference
    assert np.linalg.norm(way[len(way) // 2] - way[0]) == pytest.approx(circumference / np.pi, rel=0.05)
    speed = circumference * 0.8 / (2 * np.pi)
    straight = prior.table[:, 0, 4].mean()
    assert np.mean(lean) - straight == pytest.approx(-np.arctan(speed * 0.8 / 9.81), rel=0.05)


def test_who_slows_down_keeps_the_walk_ratio_and_who_stops_stands_on_straight_legs(model):
    rates, steps = [], []
    for ease in (1.0, 0.25):
        prior, state = quiet(model, 0.0, ease)
        began, rng = state, np.random.default_rng(9)
        for _ in range(200):
            state = prior.propagate(state, rng)
        rates.append((state.gait - began.gait)[0, PHASE])
        steps.append((state.gait - began.gait)[0, X] / rates[-1])
    assert rates[1] / rates[0] == pytest.approx(0.5, rel=1e-6)
    assert steps[1] / steps[0] == pytest.approx(0.5, rel=0.05)
    prior, state = quiet(model, 0.0, -0.5)
    after = prior.propagate(state, np.random.default_rng(9))
    np.testing.assert_allclose(after.poses, state.poses, atol=1e-12)
    walking = mean_walk(model, prior, 30)
    assert (after.poses[0, [20, 24]] < np.median(walking[:, [20, 24]], axis=0)).all()
    assert after.poses[0, 2] > np.median(walking[:, 2])


def test_a_start_is_explained_by_its_phase_and_what_is_known_of_the_frame_before_says_the_pace(prior, model):
    rng = np.random.default_rng(3)
    walk = mean_walk(model, prior, 30)
    pace = np.exp(-model.person_mean_[-2])
    truth = 20 * pace / 30 % 1
    errors = []
    for before in (None, walk[19]):
        state = prior.initial(Start.at(walk[20], before, spread=0.02), 2000, rng)
        np.testing.assert_allclose(state.poses.mean(0), walk[20], atol=0.003)
        np.testing.assert_allclose(state.poses.std(0), 0.02, rtol=0.1)
        off = (state.gait[:, PHASE] - truth + 0.5) % 1 - 0.5
        errors.append(np.abs(off).mean())
    assert errors[1] < 0.8 * errors[0] < 0.04
    slow = walk[20].copy()
    slow[:2] -= 0.5 * (walk[20] - walk[19])[:2]
    paces = [np.median(prior.initial(Start.at(walk[20], b), 2000, rng).gait[:, PACE]) for b in (walk[19], slow)]
    assert paces[1] < paces[0] - 0.12


def test_several_candidates_come_by_their_weights_and_whole_turns_do_not_matter(prior, model):
    walk = mean_walk(model, prior, 30)
    poses = walk[[5, 20]].copy()
    poses[1, :2] += [5.0, 1.0]
    poses[1, 5] += 4 * np.pi + 1.0
    poses[1, 9] += 2 * np.pi
    start = Start(poses, np.log([1.0, 3.0]), np.full((2, 25), np.nan), np.full(25, 0.01))
    rng = np.random.default_rng(4)
    state = prior.initial(start, 1000, rng)
    far = state.poses[:, 0] > 3
    assert far.sum() == 750
    assert np.abs(state.rest).max() < 1.0
    np.testing.assert_allclose(state.poses[far, 5].mean(), poses[1, 5], atol=0.01)
    after = prior.propagate(state, rng)
    assert np.abs(after.poses - state.poses).max() < 1.0


def test_moved_puts_walkers_where_told_and_they_go_on_from_there(prior, model):
    rng = np.random.default_rng(5)
    state = prior.initial(Start.at(mean_walk(model, prior, 30)[5]), 50, rng)
    poses = state.poses + 0.1 * rng.standard_normal((50, 25))
    moved = prior.moved(state, poses)
    np.testing.assert_allclose(moved.poses, poses, atol=1e-12)
    np.testing.assert_array_equal(moved.scores, state.scores)
    again = prior.posed(moved.gait.copy(), moved.scores, moved.rest)
    np.testing.assert_allclose(again.poses, poses, atol=1e-9)
    same = prior.moved(state, state.poses)
    np.testing.assert_allclose(same.rest, state.rest, atol=1e-12)


def test_diffusing_stirs_without_a_step_and_takes_nothing_from_the_spread(prior, model):
    rng = np.random.default_rng(6)
    one = prior.initial(Start.at(mean_walk(model, prior, 30)[5], spread=0.0), 20, rng).take(np.zeros(4000, dtype=int))
    still = prior.diffuse(one, 0.0, rng)
    np.testing.assert_allclose(still.poses, one.poses, atol=1e-9)
    half, whole = (prior.diffuse(one, share, rng) for share in (0.5, 1.0))
    np.testing.assert_allclose(half.rest.std(0)[SHAPED] * 2, whole.rest.std(0)[SHAPED], rtol=0.08)
    np.testing.assert_allclose(whole.poses[:, :2].mean(0), one.poses[0, :2], atol=0.001)


def test_the_seed_says_all(prior, model):
    start = Start.at(mean_walk(model, prior, 30)[5])
    runs = []
    for _ in range(2):
        rng = np.random.default_rng(7)
        runs.append(prior.diffuse(prior.propagate(prior.initial(start, 40, rng), rng), 0.5, rng))
    np.testing.assert_array_equal(runs[0].poses, runs[1].poses)
    taken = runs[0].take(np.array([3, 3, 9]))
    for name in ("poses", "scores", "rest", "gait"):
        np.testing.assert_array_equal(getattr(taken, name), getattr(runs[0], name)[[3, 3, 9]])


def test_other_models_and_rates_are_refused():
    with pytest.raises(MotionError, match="WalkingModel"):
        FPCAPrior("walk/eigenwalkers")
    with pytest.raises(MotionError, match="fps"):
        FPCAPrior(fps=0)


def test_a_body_of_unknown_size_strides_and_stands_in_proportion_and_steps_as_pendulums_swing(model):
    """Steps of 0.85 of the length, quicker by 1 / √0.85 (Hof 1996)."""
    prior = FPCAPrior(model, size=0.06)
    start = mean_walk(model, prior, 30)[0]
    rng = np.random.default_rng(0)
    went = []
    for scale in (1.0, 0.85):
        at = Start.at(start * np.r_[1, 1, scale, np.ones(22)], spread=0.0)
        state = prior.initial(at, 3000, rng)
        logs = np.log(state.sizes)  # legs differ in people of a stature
        assert logs.mean() == pytest.approx(np.log(at.poses[0, 2] / prior.table[:, 0, 2].mean()), abs=0.002)
        assert logs.std() == pytest.approx(_LEGS, rel=0.05)
        state.gait[:, PACE] = prior.log_pace
        state.scores[:], state.rest[:] = 0.0, 0.0
        first = state.poses[:, :2].mean(axis=0)
        for _ in range(35):
            state = prior.propagate(state, rng)
        went.append([np.linalg.norm(state.poses[:, :2].mean(axis=0) - first), state.poses[:, 2].mean()])
    np.testing.assert_allclose(np.divide(went[1], went[0]), [np.sqrt(0.85), 0.85], rtol=0.04)


def test_a_resized_body_stands_as_much_farther_away_and_looks_the_same(model):
    prior, camera = FPCAPrior(model, size=0.06), view(0.5, distance=9.0)
    rng = np.random.default_rng(0)
    state = prior.propagate(prior.initial(Start.at(mean_walk(model, prior, 30)[0]), 50, rng), rng)
    grown = prior.resized(state, state.sizes * 1.1, camera.centre[:2])
    np.testing.assert_allclose(grown.sizes, 1.1 * state.sizes)
    joints = [
        camera.centre * [1, 1, 0] + sizes[:, None, None] * (markers(poses, prior.skeleton) - poses[:, None, :3])
        + (poses[:, :3] - camera.centre * [1, 1, 0])[:, None]
        for poses, sizes in ((state.poses, state.sizes), (grown.poses, grown.sizes))
    ]  # fmt: skip
    ground = camera.centre * [1, 1, 0]
    np.testing.assert_allclose(joints[1] - ground, 1.1 * (joints[0] - ground), rtol=1e-9, atol=1e-9)
    later, same = prior.propagate(grown, np.random.default_rng(1)), prior.propagate(state, np.random.default_rng(1))
    np.testing.assert_allclose(later.sizes / same.sizes, 1.1, rtol=0.01)  # it stays as large
