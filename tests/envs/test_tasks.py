"""Named tasks: what they are made of, and that their splits don't share what they shouldn't."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

import motionenv.envs  # noqa: F401 (registers the tasks)
from motionenv.envs.agents import MeanPose, evaluate
from motionenv.envs.tasks import ENVIRONMENTS, SPLITS, TASKS, settings
from motionenv.errors import MotionError
from motionenv.mocap import write
from motionenv.models.synthesis import synthesize


@pytest.mark.parametrize("task", TASKS)
def test_every_task_runs_in_every_split_single_and_in_vectors(task):
    for split in SPLITS:
        how = {**settings(task, split), "horizon": 3}
        env, envs = gymnasium.make(task, **how), gymnasium.make_vec(task, num_envs=2, **how)
        assert env.spec.max_episode_steps == 3
        alone, _ = env.reset(seed=1)
        together, _ = envs.reset(seed=1)
        for name in alone if isinstance(alone, dict) else [...]:
            np.testing.assert_array_equal(alone[name], together[name][0])
        for _ in range(3):
            *_, truncated, _ = env.step(env.action_space.sample())
        assert truncated
        assert np.isfinite(env.unwrapped.truth()["joints"]).all()


def bodies(task: str, split: str) -> set[float]:
    envs = gymnasium.make_vec(task, num_envs=40, **{**settings(task, split), "horizon": 3})
    envs.reset(seed=0)
    return {round(truth["skeleton"].height, 9) for truth in envs.unwrapped.truth()}


def test_splits_share_no_walker_and_others_are_out_of_distribution():
    task = "motionenv/WalkerTracking-Easy-v1"
    train, evaluation, ood = (bodies(task, split) for split in SPLITS)
    assert not train & evaluation
    assert max(ood) < min(train | evaluation)


def test_capture_is_out_of_distribution_and_its_people_are_those_for_evaluation(tmp_path):
    for i, person in enumerate(["02", "05", "06", "07", "10", "12", "16", "26"]):
        write(synthesize("walk/fpca", 4.5, 30.0, seed=i, height=1.5 + 0.05 * i), tmp_path / f"{person}_01.npz")
    how = settings("motionenv/WalkerTracking-Medium-v1", "ood", motion=str(tmp_path))
    env = gymnasium.make("motionenv/WalkerTracking-Medium-v1", **how).unwrapped
    found = set()
    for seed in range(20):
        env.reset(seed=seed)
        found.add(round(env.truth()["skeleton"].height, 6))
    assert 0 < len(found) < 8
    assert env.spec.kwargs["split"] == "eval"


@pytest.mark.parametrize("task", [task for task, made in TASKS.items() if made.full and made.full != task])
@pytest.mark.parametrize("split", ["eval", "ood"])
def test_twins_show_the_truth_of_the_same_episodes(task, split):
    how = {**settings(task, split), "horizon": 4}
    envs, full = (gymnasium.make_vec(name, num_envs=3, **how) for name in (task, TASKS[task].full))
    envs.reset(seed=5)
    seen, _ = full.reset(seed=5)
    for _ in range(6):  # beyond the end of an episode
        truths = np.stack([truth["joints"] for truth in envs.unwrapped.truth()])
        np.testing.assert_array_equal(seen, truths.astype(np.float32))
        assert full.observation_space.contains(seen)
        actions = envs.action_space.sample()
        _, rewards, *_ = envs.step(actions)
        seen, others, *_ = full.step(actions)
        np.testing.assert_array_equal(rewards, others)


@pytest.mark.parametrize("task", [task for task, made in TASKS.items() if made.reward_threshold is not None])
def test_who_is_a_tenth_as_wrong_as_the_mean_pose_has_solved_a_task(task):
    """As the oracle's return is 0, that is a normalised return of 0.9."""
    env = gymnasium.make_vec(TASKS[task].full, num_envs=64, vectorization_mode="vector_entry_point", split="train")
    worst = evaluate(env, MeanPose(env), 64, seed=0).returns.mean()
    assert gymnasium.spec(task).reward_threshold == pytest.approx(0.1 * worst, rel=0.1)


def test_tasks_and_splits_that_there_are_not_are_refused():
    with pytest.raises(MotionError, match="task must be one of motionenv/WalkerTracking-Easy-v1, .*got 'walking'"):
        settings("walking")
    with pytest.raises(MotionError, match="split must be one of train, eval, ood, got 'test'"):
        settings(next(iter(TASKS)), "test")
    with pytest.raises(MotionError, match="use it with split 'ood', got 'eval'"):
        settings(next(iter(TASKS)), motion="folder")


@pytest.mark.parametrize(("level", "share"), [("Easy-v1", 1.0), ("Medium-v1", 0.93), ("Hard-v2", 0.93)])
def test_walkers_can_be_seen_most_of_the_time_and_the_less_the_harder_it_is(level, share):
    envs = gymnasium.make_vec(
        f"motionenv/WalkerTracking-{level}", num_envs=32, split="train", observation="mask", noise=0.0
    )
    envs.reset(seed=300)
    seen = [(envs.step(envs.action_space.sample())[0] > 0).sum(axis=(1, 2, 3)) >= 5 for _ in range(90)]
    assert share - 0.02 <= np.mean(seen) <= min(1.0, share + 0.05)


def test_nobody_passes_in_the_first_second_of_hard():
    task, apart = "motionenv/WalkerTracking-Hard-v2", 0
    for seed in range(12):
        shown = {"observation": ("mask", "depth"), "occluders": 0, "split": "train"}
        env, before = gymnasium.make(task, **shown), gymnasium.make(task, **shown, alone=0)
        seen, _ = env.reset(seed=seed)
        others = []
        for _ in range(90):
            others.append(((seen["depth"] < 20) & (seen["mask"] == 0)).any())
            seen, *_ = env.step(env.action_space.sample())
        assert not any(others[:30])
        assert any(others[30:])
        before.reset(seed=seed)
        for _ in range(90):
            before.step(before.action_space.sample())
        np.testing.assert_array_equal(env.unwrapped.truth()["joints"], before.unwrapped.truth()["joints"])
        apart += others[30] != others[59]
    assert apart > 3  # they come at different times


ID = "motionenv/WalkerTracking-v1"


@pytest.mark.parametrize(
    "script",
    [
        "import gymnasium, motionenv.envs\n"
        f"gymnasium.register_envs(motionenv.envs)\nassert gymnasium.make({ID!r}).spec.namespace == 'motionenv'",
        f"import gymnasium\ngymnasium.make('motionenv.envs:{ID}')",
        "import motionenv.envs, sys\nassert 'numba' not in sys.modules",
        f"import gymnasium, motionenv\ntry:\n    gymnasium.make({ID!r})\n"
        "except gymnasium.error.NamespaceNotFound:\n    pass\nelse:\n    raise AssertionError",
    ],
)
def test_in_a_fresh_process(script):
    run = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_docstrings_have_the_house_headings(name):
    import gymnasium

    entry = gymnasium.spec(name).entry_point
    text = gymnasium.envs.registration.load_env_creator(entry).__doc__
    headings = ["Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End",
                "Arguments", "Vectorized environment", "Version History"]  # fmt: skip
    at = [text.find(f"## {heading}\n") for heading in headings]
    assert -1 not in at
    assert at == sorted(at)
