"""TorchRL steps the environments: one at a time by name, and the native vector environment in a batch."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

pytest.importorskip("torchrl", reason="TorchRL is missing: pip install -e '.[integrations]'")

from torchrl.envs import GymEnv, GymWrapper, check_env_specs

import motionenv.envs  # noqa: F401 (registers the environments)

pytestmark = pytest.mark.integration

WALKER, MARKERS = "motionenv/WalkerTracking-v1", "motionenv/MarkerTracking-v1"
HORIZON = 10
SMALL = {"size": 36, "horizon": HORIZON}


@pytest.mark.parametrize(("name", "settings"), [(WALKER, SMALL), (MARKERS, {"horizon": HORIZON})])
def test_one_environment_by_name(name, settings):
    env = GymEnv(name, **settings)
    check_env_specs(env)
    rollout = env.rollout(50)
    assert rollout.shape == (HORIZON,)
    assert rollout["next", "truncated"][-1]
    assert (rollout["next", "reward"] < 0).all()
    env.close()


@pytest.mark.parametrize("mode", [AutoresetMode.DISABLED, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize(("name", "settings"), [(WALKER, SMALL), (MARKERS, {"horizon": HORIZON})])
def test_the_vector_environment_in_a_batch(name, settings, mode):
    """Rewards are those of the bare vector environment for the same seed and actions; episodes follow on each other."""
    make = lambda: gymnasium.make_vec(
        name, num_envs=4, vectorization_mode="vector_entry_point", autoreset_mode=mode, **settings
    )
    env = GymWrapper(make())
    env.set_seed(3)
    rollout = env.rollout(3 * HORIZON, break_when_any_done=False)
    assert rollout.shape == (4, 3 * HORIZON)
    ends = rollout["next", "done"][..., 0].numpy()
    assert (np.flatnonzero(ends[0]) == np.array([1, 2, 3]) * HORIZON - 1).all()
    bare = make()
    bare.reset(seed=3)
    bare.reset()  # seeding made an episode of its own
    for t in range(HORIZON):
        rewards = bare.step(rollout["action"][:, t].numpy())[1]
        np.testing.assert_allclose(rollout["next", "reward"][:, t, 0], rewards, rtol=1e-6)
    env.close()
    bare.close()
