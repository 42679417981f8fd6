"""`send` and `recv` return what `step` does, to the bit, in any batches, and arrays that other libraries can share."""

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import motionenv.envs  # noqa: F401 (registers the environments)
from motionenv.errors import MotionError

N = 6


def rows(part, i: int):
    """Row i of an array, or of each array of a dict, in depth."""
    if isinstance(part, dict):
        return {name: rows(value, i) for name, value in part.items() if name != "env_id"}
    return part[i]


def agree(a, b) -> bool:
    """Equal to the last bit, in depth; an info that a batch lacks is 0 in the other."""
    if isinstance(a, dict) or isinstance(b, dict):
        a, b = a or {}, b or {}
        return all(agree(a.get(k), b.get(k)) for k in {*a, *b})
    return np.array_equal(*(0 if x is None else x for x in (a, b)))


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("batch", [1, 2, 4, 6])
def test_each_environment_sees_what_it_would_see_in_step(kind, mode, batch):
    sync = kind.vector(N, autoreset_mode=mode, lost_after=0.05)
    envs = kind.vector(N, autoreset_mode=mode, lost_after=0.05, batch_size=batch, threads=2)
    sync.action_space.seed(0)
    actions = [sync.action_space.sample() for _ in range(40)]
    told = [sync.reset(seed=3), *(sync.step(a) for a in actions)]
    envs.async_reset(seed=3)
    rng, count = np.random.default_rng(batch), np.zeros(N, dtype=int)
    resting = np.zeros(0, dtype=int)
    while count.min() < 20 and count.max() < 40:
        *returned, infos = envs.recv()
        ids = infos["env_id"]
        assert len(ids) == batch
        assert (np.diff(ids) > 0).all()
        for row, i in enumerate(ids):
            expected = told[count[i]]
            assert agree(rows(returned[0], row), rows(expected[0], i))
            if count[i]:
                for mine, theirs in zip((*returned[1:], infos), expected[1:], strict=True):
                    assert agree(rows(mine, row), rows(theirs, i))
            else:
                assert (returned[1][row], returned[2][row], returned[3][row]) == (0, False, False)
            count[i] += 1
        # Environments wait for different times, are sent in any order, and in different company.
        resting = rng.permutation(np.append(resting, ids))
        least = max(batch - (N - len(resting)), 0)
        some, resting = np.split(resting, [rng.integers(least, len(resting) + 1)])
        envs.send(np.array([actions[count[i] - 1][i] for i in some]).reshape(-1, *actions[0].shape[1:]), some)
    envs.close()
    assert count.max() > 16  # episodes have 15 estimates: some began anew


def test_the_same_calls_return_the_same_batches(kind):
    def ids():
        envs = kind.vector(5, batch_size=2)
        envs.async_reset(seed=0)
        for _ in range(12):
            *_, infos = envs.recv()
            envs.send(np.zeros((2, *envs.single_action_space.shape)), infos["env_id"])
            yield infos["env_id"].tolist()

    assert list(ids()) == list(ids())


def test_observations_are_shared_by_dlpack_without_copies(kind):
    envs = kind.vector(4, batch_size=2)
    envs.async_reset(seed=0)
    batches = [envs.reset(seed=0)[0] for envs in [kind.vector(4)]]
    for _ in range(2):
        observed, rewards, terminated, truncated, infos = envs.recv()
        envs.send(np.zeros((2, *envs.single_action_space.shape)), infos["env_id"])
        batches += [observed, rewards, terminated, truncated]
    for batch in batches:
        for array in batch.values() if isinstance(batch, dict) else [batch]:
            assert array.flags.c_contiguous
            assert array.flags.writeable
            shared = np.from_dlpack(array)
            assert np.shares_memory(shared, array)


def test_torch_writes_into_the_observations():
    torch = pytest.importorskip("torch")
    envs = gymnasium.make_vec("motionenv/WalkerTracking-v1", num_envs=4, batch_size=2, size=36)
    envs.async_reset(seed=0)
    observed, *_ = envs.recv()
    tensor = torch.from_dlpack(observed)
    tensor[0] = 7
    assert (observed[0] == 7).all()
    assert tensor.data_ptr() == observed.ctypes.data
    envs.close()


def test_what_cannot_be_sent_is_named_and_nothing_is_sent(kind):
    envs = kind.vector(4, batch_size=2)
    idle = np.zeros((2, *envs.single_action_space.shape))
    with pytest.raises(ResetNeeded):
        envs.send(idle, np.array([0, 1]))
    with pytest.raises(MotionError, match=r"recv\(\) returns 2 environments, but 0"):
        envs.recv()
    envs.async_reset(seed=1)
    for call in (envs.async_reset, envs.reset, envs.truth, lambda: envs.step(np.concatenate([idle, idle]))):
        with pytest.raises(MotionError, match="recv"):
            call()
    with pytest.raises(MotionError, match=r"environments \[0, 1\] have been sent"):
        envs.send(idle, np.array([0, 1]))
    envs.recv(), envs.recv()
    for ids, why in [
        ([0, 0], "different"),
        ([0, 4], "from 0 to 3"),
        ([0, -1], "from 0 to 3"),
        ([0.0, 1.0], "whole numbers"),
        ([0], "shape"),
    ]:
        with pytest.raises(MotionError, match=why):
            envs.send(idle, np.array(ids))
    with pytest.raises(MotionError, match="finite"):
        envs.send(idle + np.nan, np.array([0, 1]))
    envs.reset(seed=1)
    envs.send(idle[:1], np.array([3]))
    with pytest.raises(MotionError, match="2 environments, but 1"):
        envs.recv()
    envs.close()
    envs.async_reset(seed=1)  # a closed environment starts again
    assert envs.recv()[4]["env_id"].tolist() == [0, 1]
    envs.close()


@pytest.mark.parametrize("batch_size", [0, 5, 1.5])
def test_an_impossible_batch_is_named(kind, batch_size):
    with pytest.raises(MotionError, match="batch_size"):
        kind.vector(4, batch_size=batch_size)
