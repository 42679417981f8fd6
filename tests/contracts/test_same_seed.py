"""The same seed gives the same motion through HTTP, Python, the command line and the environment."""

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

import motionenv
from motionenv import MotionError
from motionenv.cli import app
from motionenv.envs import ArmTracking
from motionenv.envs.simulation.motion_sources import Source

SECONDS, FPS = 4.0, 30.0
HORIZON = int(SECONDS * FPS) - 1
ASKED = [
    pytest.param({"model": "walk/fpca", "seed": 7}, id="fpca"),
    pytest.param({"model": "walk/fpca", "seed": 2**40, "speed": 1.4, "height": 1.62}, id="fpca, speed and height"),
    pytest.param({"model": "walk/eigenwalkers", "seed": 3, "speed": 1.2, "height": 1.8}, id="eigenwalkers"),
    pytest.param({"model": "walk/prior", "seed": 5, "person": "girl"}, id="prior, a girl"),
]
HEAVY = [
    pytest.param({"model": model, "seed": 4, "person": "man", "weight": 118.0, "height": 1.8}, id=f"{model}, heavy")
    for model in ("walk/fpca", "walk/eigenwalkers", "walk/prior")
]


def same(motion: motionenv.Motion, other: motionenv.Motion) -> None:
    np.testing.assert_array_equal(motion.poses, other.poses)
    np.testing.assert_array_equal(motion.skeleton.offsets, other.skeleton.offsets)
    np.testing.assert_array_equal(motion.skeleton.radii, other.skeleton.radii)
    assert (motion.fps, motion.skeleton.height) == (other.fps, other.skeleton.height)


@pytest.fixture
def python():
    """What Python makes of a request."""
    return lambda asked: motionenv.synthesize(
        asked["model"], SECONDS, FPS, **{k: asked[k] for k in asked if k != "model"}
    )


@pytest.mark.parametrize("asked", ASKED + HEAVY)
def test_through_http(server, python, tmp_path, asked):
    motion = python(asked)
    body = {**asked, "seconds": SECONDS, "fps": FPS}
    told = server.http.post("/v1/synthesis", json=body).json()
    body_of = motionenv.Skeleton(told["offsets"], told["radii"], told["height"])
    same(motionenv.Motion(told["poses"], body_of, told["fps"]), motion)
    file = tmp_path / "walk.npz"
    file.write_bytes(server.http.post("/v1/synthesis", json=body, headers={"Accept": "application/x-npz"}).content)
    same(motionenv.read(file), motion)


@pytest.mark.parametrize("asked", ASKED + HEAVY)
def test_through_the_command_line(python, tmp_path, asked):
    out = tmp_path / "walk.npz"
    options = [f"--{name}={value}" for name, value in asked.items() if name != "model"]
    words = ["synth", asked["model"], f"--seconds={SECONDS}", f"--fps={FPS}", f"--out={out}", *options]
    run = CliRunner().invoke(app, words)
    assert run.exit_code == 0, run.output
    same(motionenv.read(out), python(asked))


def arguments(asked: dict) -> dict:
    """Those of an environment: what else is one number is a range there."""
    ranges = {name: (asked[name], asked[name]) for name in ("speed", "height") if name in asked}
    who = {"person": asked.get("person", "adult"), **ranges}
    return {"motion": asked["model"], "motion_seed": asked["seed"], "fps": FPS, "horizon": HORIZON, **who}


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("split", ["train", "eval"])
def test_through_the_environment(python, asked, split):
    """All of every episode; only where the origin is on the ground is up to the camera."""
    motion = python(asked)
    env = gymnasium.make(
        "motionenv/WalkerTracking-v1",
        observation="mask",
        split=split,
        actions="metric",
        start="line",
        **arguments(asked),
    )
    for seed in (0, 1):
        env.reset(seed=seed)
        truths, ended = [env.unwrapped.truth()], False
        while not ended:
            *_, terminated, ended, _ = env.step(truths[-1]["pose"].astype("float32"))
            assert not terminated
            truths.append(env.unwrapped.truth())
        poses = np.array([truth["pose"] for truth in truths])
        np.testing.assert_array_equal(poses[:, 2:], motion.poses[: len(poses), 2:])
        np.testing.assert_allclose(np.ptp(poses[:, :2] - motion.poses[: len(poses), :2], axis=0), 0, atol=1e-12)
        np.testing.assert_array_equal(truths[0]["skeleton"].offsets, motion.skeleton.offsets)
        np.testing.assert_array_equal(truths[0]["skeleton"].radii, motion.skeleton.radii)
        assert len(poses) >= HORIZON
    env.close()


@pytest.mark.parametrize("asked", ASKED)
def test_what_episodes_are_cut_from_is_the_motion_to_the_last_bit(python, asked):
    how = arguments(asked)
    ranges = {name: how[name] for name in ("speed", "height", "person") if name in how}
    source = Source(asked["model"], "train", HORIZON + 1, FPS, seed=asked["seed"], **ranges)
    poses, body = source.open().draw(np.random.default_rng(5))
    same(motionenv.Motion(poses, body, FPS), python(asked))


def test_what_one_motion_cant_be_made_with_is_refused(tmp_path):
    make = lambda **how: gymnasium.make("motionenv/WalkerTracking-v1", motion_seed=1, **how)
    with pytest.raises(MotionError, match="speed must be a single value with motion_seed"):
        make(speed=(1.0, 1.5))
    with pytest.raises(MotionError, match="motion_seed must be a whole number"):
        gymnasium.make("motionenv/WalkerTracking-v1", motion_seed=-1)
    motionenv.write(motionenv.synthesize("walk/fpca", 5, 30, seed=1), tmp_path / "walk.npz")
    with pytest.raises(MotionError, match="motion_seed needs a model as motion"):
        make(motion=str(tmp_path / "walk.npz"))
    with pytest.raises(MotionError, match="motion_seed needs a model as motion"):
        ArmTracking(motion_seed=1)
