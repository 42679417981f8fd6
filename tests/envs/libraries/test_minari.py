"""Minari's DataCollector writes episodes of the environments to disk and loads them again."""

import gc
from collections.abc import Iterator

import gymnasium
import numpy as np
import pytest

import motionenv.envs  # noqa: F401 (registers the environments)

minari = pytest.importorskip("minari", reason="Minari is missing: pip install -e '.[integrations]'")
pytest.importorskip("h5py", reason="Minari's storage is missing: pip install -e '.[integrations]'")

pytestmark = [
    pytest.mark.integration,
    pytest.mark.filterwarnings("ignore:.* is set to None"),  # what published datasets should say about themselves
    pytest.mark.filterwarnings("ignore:Implicitly cleaning up <TemporaryDirectory:ResourceWarning"),
]

HORIZON = 8


@pytest.fixture(autouse=True)
def datasets(tmp_path, monkeypatch) -> Iterator[None]:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    yield
    gc.collect()  # Minari leaves its temporary folders for Python to remove, which warns: here, not in a later test


def collector(name: str, callback: type = minari.StepDataCallback, **settings) -> gymnasium.Env:
    env = gymnasium.make(name, horizon=HORIZON, **settings)
    infos = callback is not minari.StepDataCallback
    return minari.DataCollector(env, step_data_callback=callback, record_infos=infos, jpeg_encoding=False)


def played(env: gymnasium.Env, seeds: range) -> list[dict]:
    """Episodes of random estimates: what `env` returned in each."""
    env.action_space.seed(0)
    episodes = []
    for seed in seeds:
        observations, rewards, actions, errors, ended = [env.reset(seed=seed)[0]], [], [], [], False
        while not ended:
            actions.append(env.action_space.sample())
            observation, reward, terminated, truncated, info = env.step(actions[-1])
            observations.append(observation)
            rewards.append(reward)
            errors.append(info["error"])
            ended = terminated or truncated
        episodes.append({"observations": observations, "actions": actions, "rewards": rewards, "errors": errors})
    return episodes


def stacked(observations: list) -> dict[str, np.ndarray]:
    if isinstance(observations[0], dict):
        return {key: np.stack([o[key] for o in observations]) for key in observations[0]}
    return {"": np.stack(observations)}


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("motionenv/WalkerTracking-v1", {"size": 36, "observation": "rgb"}),
        ("motionenv/WalkerTracking-v1", {"size": 36, "observation": ("mask", "depth")}),
        ("motionenv/MarkerTracking-v1", {"noise": 0.02}),
        ("motionenv/ArmTracking-v1", {}),
    ],
)
def test_episodes_come_back_from_disk(name, settings):
    with collector(name, **settings) as env:
        expected = played(env, range(3))
        env.create_dataset("motionenv/test-v0")
    dataset = minari.load_dataset("motionenv/test-v0")
    assert dataset.total_episodes == 3
    assert dataset.total_steps == 3 * HORIZON
    for episode, played_ in zip(dataset.iterate_episodes(), expected, strict=True):
        found = episode.observations if isinstance(episode.observations, dict) else {"": episode.observations}
        for key, values in stacked(played_["observations"]).items():
            np.testing.assert_array_equal(found[key], values)
        np.testing.assert_array_equal(episode.actions, np.stack(played_["actions"]))
        np.testing.assert_array_equal(episode.rewards, played_["rewards"])
        assert episode.truncations.tolist() == [False] * (HORIZON - 1) + [True]
        assert not episode.terminations.any()


def test_the_environment_comes_back_too():
    settings = {"size": 36, "observation": "mask"}
    with collector("motionenv/WalkerTracking-v1", **settings) as env:
        expected = played(env, range(1))[0]
        env.create_dataset("motionenv/test-v0")
    with minari.load_dataset("motionenv/test-v0").recover_environment() as env:
        found = played(env, range(1))[0]
    np.testing.assert_array_equal(found["observations"], expected["observations"])
    np.testing.assert_array_equal(found["rewards"], expected["rewards"])


class Errors(minari.StepDataCallback):
    """Minari wants the same infos after `reset` as after `step`."""

    def __call__(self, env, **kwargs):
        data = super().__call__(env, **kwargs)
        data["info"] = {"error": np.nan} | {key: value for key, value in data["info"].items() if key == "error"}
        return data


def test_errors_are_recorded_when_reset_is_given_one():
    with collector("motionenv/MarkerTracking-v1", Errors) as env:
        expected = played(env, range(1))[0]
        env.create_dataset("motionenv/test-v0")
    found = next(minari.load_dataset("motionenv/test-v0").iterate_episodes()).infos["error"]
    np.testing.assert_array_equal(found, [np.nan, *expected["errors"]])
