"""A tracking environment is what Gymnasium expects of one, and says when it is misused."""

import inspect
import json
import multiprocessing
import pickle
import subprocess
import sys
import threading
import typing
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from gymnasium.wrappers import AddRenderObservation, FrameStackObservation, HumanRendering, RecordEpisodeStatistics

import motionenv.envs
from motionenv.envs import MarkerTracking, TrackingVectorEnv, WalkerTracking
from motionenv.envs.base import checked_actions
from motionenv.envs.tasks import ENVIRONMENTS
from motionenv.errors import MotionError

pytest.importorskip("gymnasium", minversion="1.4", reason="its checks of environments are new in Gymnasium 1.4")

from gymnasium.utils.env_checker import check_env, data_equivalence, data_shares_objects

IDS = ["motionenv/WalkerTracking-v1", "motionenv/ArmTracking-v1"]


def test_specs_know_how_long_an_episode_is():
    """Even where `make` gets another horizon; and remade from its specification it's truncated once, at that step."""
    for name, horizon in (("motionenv/MarkerTracking-v1", 7), ("motionenv/WalkerTracking-v1", 90)):
        env = gymnasium.make(name, **({"horizon": horizon} if horizon == 7 else {}))
        again, envs = gymnasium.make(env.spec), gymnasium.make_vec(name, num_envs=2, horizon=horizon)
        assert [e.spec.max_episode_steps for e in (env, again, envs, gymnasium.make_vec(envs.spec))] == [horizon] * 4
        again.reset(seed=0)
        ends = [again.step(0 * again.action_space.sample())[2:4] for _ in range(horizon)]
        assert ends == [(False, False)] * (horizon - 1) + [(False, True)]


@pytest.mark.parametrize(("most", "steps"), [(5, 5), (200, 7)])
def test_max_episode_steps_only_shortens_episodes_single_or_vector(most, steps):
    asked = {"max_episode_steps": most, "horizon": 7}
    one = gymnasium.make("motionenv/MarkerTracking-v1", **asked)
    many = gymnasium.make_vec(
        "motionenv/MarkerTracking-v1", num_envs=2, vectorization_mode="vector_entry_point", **asked
    )
    for env in (one, many):
        env.reset(seed=0)
        ends = [np.all(env.step(0 * env.action_space.sample())[3]) for _ in range(steps)]
        assert ends == [False] * (steps - 1) + [True]


def test_actions_that_rounding_puts_beyond_a_bound_are_on_it():
    space = gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32)
    beyond = np.nextafter(np.float32(1.0), np.float32(2.0)) * np.array([[-1, 0, 1]], np.float32)
    np.testing.assert_array_equal(checked_actions(beyond, space), [[-1, 0, 1]])
    with pytest.raises(MotionError, match="from -1 to 1, got 1.0001"):
        checked_actions(np.array([[0, 0, 1.0001]]), space)


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_signatures_show_arguments_and_a_wrong_name_gets_the_nearest(name):
    for env in (gymnasium.make(name), gymnasium.make_vec(name, num_envs=2)):
        made = env.unwrapped
        shown = inspect.signature(type(made)).parameters
        assert not any(p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL) for p in shown.values())
        for key, value in vars(made.arguments).items():
            assert typing.get_type_hints(type(made.arguments))[key] == shown[key].annotation
            assert value == (2 if key == "num_envs" else shown[key].default)
        with pytest.raises(MotionError, match=f"{type(made).__name__} has no argument 'hoizon': did you mean horizon"):
            type(made)(hoizon=3)
        with pytest.raises(MotionError, match="reset takes .*, got 'masked'"):
            env.reset(options={"masked": 1})
    with pytest.raises(MotionError, match="no argument 'picture'"):
        gymnasium.make(name, picture=1)


def test_reprs_are_a_line():
    walker = WalkerTracking(observation="mask", horizon=60)
    assert repr(walker) == "WalkerTracking(observation='mask', 64x64, horizon 60)"
    assert repr(motionenv.envs.ActiveTrackingVector(2)) == "ActiveTrackingVector(2, 3 people, 8 pillars, horizon 600)"
    assert repr(MarkerTracking()) == "MarkerTracking(motion='walk/eigenwalkers', horizon 200)"


def test_actions_say_estimates():
    env = WalkerTracking(estimate="belief", n_belief=3, size=36, horizon=30)
    env.reset(seed=0)
    belief = np.tile([*env.truth()["pose"], 2.0], (3, 1))
    belief[:, 5] += [0, 2 * np.pi, -2 * np.pi]  # angles are the same a turn on
    action = env.action(belief)
    assert action.dtype == np.float32
    np.testing.assert_allclose(action, np.tile(action[0], (3, 1)), atol=1e-6)
    back = env.estimate(action)
    np.testing.assert_allclose(back[:, :3], belief[:, :3], atol=1e-6)
    np.testing.assert_allclose(np.exp(1j * back[:, 3:25]), np.exp(1j * belief[:, 3:25]), atol=1e-6)
    np.testing.assert_allclose(back[:, 25], 2.0, atol=1e-5)
    far = env.action(belief + 1e6)
    assert env.action_space.contains(far)


def numbers(env, steps: int = 3):
    """Everything that some steps return."""
    out = [env.reset(seed=5)]
    return [*out, *(env.step(0 * env.action_space.sample()) for _ in range(steps))]


@pytest.mark.parametrize("name", IDS)
def test_gymnasiums_checker_finds_nothing(name):
    check_env(gymnasium.make(name, disable_env_checker=True, size=40).unwrapped)


def test_gymnasiums_wrapper_shows_it_in_a_window(monkeypatch):
    pygame = pytest.importorskip("pygame", reason="pygame is missing: pip install -e '.[test]'")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    with HumanRendering(gymnasium.make(IDS[0], render_mode="rgb_array", size=40)) as env:
        env.reset(seed=0)
        env.step(env.action_space.sample())
        shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
        np.testing.assert_array_equal(shown, env.unwrapped.render())


@pytest.mark.filterwarnings("ignore:.*For Box action spaces, we recommend:UserWarning")  # metric ones aren't ±1
def test_gymnasiums_checker_finds_nothing_in_other_forms(kind):
    check_env(kind.single(), skip_render_check=True)


def test_types_are_pythons_own(kind):
    env = kind.single()
    observed, info = env.reset(seed=0)
    assert info == {}
    assert env.observation_space.contains(observed)
    for i in range(15):
        observed, reward, terminated, truncated, info = env.step(kind.perfect(env.truth()))
        assert env.observation_space.contains(observed)
        assert [type(x) for x in (reward, terminated, truncated)] == [float, bool, bool]
        assert {key: type(value) for key, value in info.items()} == {"error": float, "lost": bool}
        assert -1e-6 < reward <= 0
        assert info["error"] < 1e-6
        assert (terminated, truncated) == (False, i == 14)


def test_the_same_seed_gives_the_same_episodes(kind):
    one, two = kind.single(), kind.single()
    assert data_equivalence(numbers(one), numbers(two), exact=True)
    assert data_equivalence(one.reset(), two.reset(), exact=True)  # and those that follow
    assert not data_equivalence(one.reset(), one.reset(), exact=True)
    assert not data_equivalence(one.reset(seed=1), one.reset(seed=2), exact=True)


def test_a_step_takes_nothing_from_the_generator(kind):
    env = kind.single()
    env.reset(seed=0)
    state = env.np_random.bit_generator.state
    env.step(0 * env.action_space.sample())
    env.observation_space.sample()
    assert env.np_random.bit_generator.state == state


def test_lost_tracks_are_told_and_end_nothing():
    env = WalkerTracking(size=36, lost_after=0.5, actions="metric", horizon=20)
    for _ in range(2):
        env.reset(seed=0)
        for i in range(20):
            bad = i not in (3, 15)  # one good estimate starts the count anew
            action = env.truth()["pose"] + (50.0 * (np.arange(25) == 0) if bad else 0.0)
            _, _, terminated, truncated, info = env.step(action)
            assert info["lost"] == (i in (13, 14))
            assert not terminated
            assert truncated == (i == 19)


def test_no_policy_gains_by_failing():
    """Whatever is estimated, failing on purpose from any step on, for good or for a while, never returns more."""
    env = MarkerTracking(lost_after=0.3, horizon=25)
    rng = np.random.default_rng(0)
    shift = rng.normal(0, 0.05, (25, 15, 3))
    constant = np.zeros((15, 3))
    policies = {
        "good": lambda t: env.action(env.truth()["joints"] + shift[t]),
        "constant": lambda t: constant,
        "random": lambda t: rng.uniform(-0.5, 0.5, (15, 3)),
    }
    for policy in policies.values():
        for begin, end in [(25, 25), *((begin, 25) for begin in range(0, 25, 3)), (3, 14), (0, 10)]:
            returned, kept, length, over = 0.0, 0.0, 0, False
            env.reset(seed=1)
            while not over:
                wanted = policy(length)
                error = np.linalg.norm(env.estimate(wanted) - env.truth()["joints"], axis=-1).mean()
                fails = begin <= length < end
                _, reward, terminated, truncated, _ = env.step(np.ones((15, 3)) if fails else wanted)
                returned, kept = returned + reward, kept - error
                length, over = length + 1, terminated or truncated
            assert length == 25  # what is left of an episode is paid for
            assert returned < kept - 0.5 * (end - begin) if end > begin else returned == pytest.approx(kept)


def test_pickles_in_the_middle_of_an_episode(kind):
    env = kind.single(render_mode="rgb_array")
    env.reset(seed=0)
    for _ in range(2):
        env.step(0 * env.action_space.sample())
    env.render()
    twin = pickle.loads(pickle.dumps(env))
    action = kind.perfect(env.truth())
    assert data_equivalence(env.step(action), twin.step(action), exact=True)
    assert data_equivalence(env.render(), twin.render(), exact=True)
    assert data_equivalence(env.reset(), twin.reset(), exact=True)


def test_vectors_pickle_too(kind):
    envs = kind.vector(3, threads=2)
    envs.reset(seed=0)
    envs.step(0 * envs.action_space.sample())
    twin = pickle.loads(pickle.dumps(envs))
    for _ in range(16):
        assert data_equivalence(
            envs.step(0 * envs.action_space.sample()), twin.step(0 * envs.action_space.sample()), exact=True
        )


@pytest.mark.parametrize("context", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_in_processes_as_in_this_one(context):
    make = partial(WalkerTracking, size=36, horizon=4, background="clutter")
    here = SyncVectorEnv([make] * 2)
    here.reset(seed=0)  # threads and tables exist before the fork
    there = AsyncVectorEnv([make] * 2, context=context)
    try:
        assert data_equivalence(here.reset(seed=3), there.reset(seed=3), exact=True)
        for _ in range(6):
            actions = 0 * here.action_space.sample()
            assert data_equivalence(here.step(actions), there.step(actions), exact=True)
    finally:
        there.close()


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_a_vector_with_threads_forks():
    envs = motionenv.envs.WalkerTrackingVector(8, size=36, threads=2)
    envs.reset(seed=0)
    envs.step(0 * envs.action_space.sample())
    answer = multiprocessing.get_context("fork").Queue()

    def child() -> None:
        answer.put(int(envs.step(0 * envs.action_space.sample())[0].sum()))

    process = multiprocessing.get_context("fork").Process(target=child)
    process.start()
    assert answer.get(timeout=60) == int(envs.step(0 * envs.action_space.sample())[0].sum())
    process.join(60)
    assert process.exitcode == 0


SCRIPT = """
import hashlib, json, numpy as np, gymnasium, motionenv.envs
env = gymnasium.make("motionenv/WalkerTracking-v1", size=40, background="clutter", noise=3, speed=(1, 1.5))
digest = hashlib.sha256(env.reset(seed=11)[0].tobytes())
for _ in range(5):
    observed, reward, *_ = env.step(np.zeros(25, np.float32))
    digest.update(observed.tobytes() + np.float64(reward).tobytes())
print(digest.hexdigest())
"""


def test_the_same_in_every_process():
    runs = [subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True) for _ in (1, 2)]
    assert len({run.stdout for run in runs}) == 1


def threads() -> int:
    """Threads that environments have started; the library's own pool stays as long as the process."""
    return sum(not thread.name.startswith("motionenv") for thread in threading.enumerate())


def test_closing_ends_threads_and_leaves_it_usable():
    envs = motionenv.envs.WalkerTrackingVector(8, size=36, threads=3, estimate="belief", n_belief=4)
    before = threads()
    envs.reset(seed=0)
    for _ in range(2):
        envs.step(0 * envs.action_space.sample())
        assert threads() > before
        envs.world.close()
        assert threads() == before
    envs.close()
    envs.close()


def test_closing_twice_ends_all_threads_and_a_reset_opens_again(kind):
    before = threads()
    for env in (kind.single(render_mode="rgb_array"), kind.vector(2)):
        env.close()
        first, _ = env.reset(seed=0)
        env.close()
        env.close()
        again, _ = env.reset(seed=0)
        assert data_equivalence(first, again, exact=True)
        env.close()
        assert threads() == before


@pytest.mark.parametrize("name", IDS)
def test_specs_survive_json(name):
    env = gymnasium.make(name, size=40, observation=["mask", "depth"], camera=30.0, horizon=5)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.spec == env.spec
    assert data_equivalence(numbers(env), numbers(again), exact=True)


@pytest.mark.parametrize("name", IDS)
def test_make_vec_takes_the_native_vector(name):
    envs = gymnasium.make_vec(name, num_envs=3, size=40, autoreset_mode="SameStep")
    assert isinstance(envs, TrackingVectorEnv)
    assert envs.num_envs == 3
    assert envs.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.SAME_STEP
    again = gymnasium.make_vec(EnvSpec.from_json(json.dumps(json.loads(envs.spec.to_json()))))
    assert data_equivalence(envs.reset(seed=0), again.reset(seed=0), exact=True)
    sync = gymnasium.make_vec(name, num_envs=3, size=40, vectorization_mode="sync")
    assert data_equivalence(envs.reset(seed=0), sync.reset(seed=0), exact=True)


def test_whatever_is_returned_is_new(kind):
    env = kind.single()
    kept = [env.reset(seed=0), *(env.step(0 * env.action_space.sample()) for _ in range(15)), env.reset()]
    for i, one in enumerate(kept):
        assert not any(data_shares_objects(one, other) for other in kept[i + 1 :])
    truth, again = env.truth(), env.truth()
    truth["pose"][:] = 0.0
    truth["joints"][:] = 0.0
    assert again["pose"].any()
    assert env.truth()["pose"].any()


def test_render_shows_the_estimate_over_its_frame(kind):
    assert kind.single().render() is None
    env = kind.single(render_mode="rgb_array")
    with pytest.raises(ResetNeeded):
        env.render()
    env.reset(seed=0)
    before = env.render()
    assert before.dtype == np.uint8
    assert before.shape == (288, 288, 3)
    env.step(kind.perfect(env.truth()))
    drawn = env.render()
    assert 0.002 < (before != drawn).any(-1).mean() < 0.2
    env.step(0 * env.action_space.sample())
    assert (drawn != env.render()).any()


def test_gymnasiums_wrappers_work():
    env = FrameStackObservation(WalkerTracking(size=36, horizon=3), 4)
    assert env.reset(seed=0)[0].shape == (4, 36, 36, 3)
    env = AddRenderObservation(WalkerTracking(size=36, render_mode="rgb_array"), render_only=True)
    assert env.reset(seed=0)[0].shape == (288, 288, 3)
    env = RecordEpisodeStatistics(WalkerTracking(size=36, horizon=3))
    env.reset(seed=0)
    rewards = [env.step(np.zeros(25, np.float32)) for _ in range(3)]
    assert rewards[-1][-1]["episode"]["r"] == pytest.approx(sum(r[1] for r in rewards))
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(motionenv.envs.WalkerTrackingVector(2, size=36, horizon=3))
    envs.reset(seed=0)
    *_, infos = [envs.step(np.zeros((2, 25), np.float32)) for _ in range(3)][-1]
    assert infos["episode"]["l"].tolist() == [3, 3]


def test_misuse_is_named_and_changes_nothing(kind):
    env, twin = kind.single(), kind.single()
    good = 0 * env.action_space.sample()
    with pytest.raises(ResetNeeded):
        env.step(good)
    with pytest.raises(ResetNeeded):
        env.truth()
    with pytest.raises(ResetNeeded):
        _ = env.observation_model
    env.reset(seed=1), twin.reset(seed=1)
    for action, why in [
        (good + np.nan, "must be finite and from .* got nan"),
        (good + np.inf, "must be finite and from .* got inf"),
        (good - 1e4, "must be finite and from"),
        (good[..., :-1], "shape"),
        (good[None], "shape"),
        (0.0, "shape"),
        (None, "numbers"),
        ("up", "numbers"),
        (good.astype(complex), "numbers"),
        (good > 0, "numbers"),
    ]:
        with pytest.raises(MotionError, match=why):
            env.step(action)
    assert data_equivalence(env.step(good), twin.step(good), exact=True)
    for _ in range(14):
        env.step(good.astype(np.float64).tolist())
    with pytest.raises(ResetNeeded, match="reset"):
        env.step(good)
    assert env.truth()["pose"].shape == (25,)


def test_actions_are_checked_where_they_are_read():
    space = gymnasium.spaces.Box(-2, 3, (2,), np.float32)
    bad = np.array([[1.0, 2.0], [np.nan, 9.0]])
    read = checked_actions(bad, space, np.array([True, False]))
    assert read.dtype == np.float64
    assert read.tolist() == [[1.0, 2.0], [0.0, 0.0]]
    with pytest.raises(MotionError, match=r"action\[0\] of environment 1 must be finite and from -2 to 3, got nan"):
        checked_actions(bad, space)
    with pytest.raises(MotionError, match=r"action\[1\] must be finite and from -2 to 3, got 3.5"):
        checked_actions([[1.0, 3.5]], space)
    with pytest.raises(MotionError, match=r"numbers of shape \(3, ...\) of \(2,\), got float64 of shape \(2, 2\)"):
        checked_actions(bad, space, np.ones(3, bool))
    with pytest.raises(MotionError, match=r"an array of shape \(2,\), got lists of different lengths"):
        checked_actions([[1.0, 2.0], [1.0]], space)
