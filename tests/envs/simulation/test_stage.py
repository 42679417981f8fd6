"""Pictures of a stage are those of its truth, drawn by itself."""

import numpy as np
import pytest

from motionenv.body import markers
from motionenv.envs import WalkerTrackingVector
from motionenv.envs.simulation.motion_sources import Source
from motionenv.envs.simulation.stage import PictureSettings, Stage
from motionenv.envs.simulation.views import WalkingView
from motionenv.errors import MotionError
from motionenv.render import render
from motionenv.render.sensors.augmentation import FAR, Augmentation
from motionenv.types import Frame
from tests.envs.playing import begun


@pytest.mark.parametrize("camera", ["side", "front", 45, -120.5, "random", "follow"])
def test_pictures_show_the_truth(camera):
    env, seen = begun(camera=camera, seed=3)
    for _ in range(20):
        truth = env.truth()
        np.testing.assert_array_equal(truth["joints"], markers(truth["pose"], truth["skeleton"]))
        frame = render(truth["pose"], truth["skeleton"], truth["camera"])
        np.testing.assert_array_equal(seen["mask"][..., 0], np.where(frame.limbs > 0, 255, 0))
        body = frame.limbs > 0
        np.testing.assert_array_equal(seen["depth"][body, 0], frame.depth[body])
        assert (seen["depth"][~body] == FAR).all()
        seen, *_ = env.step(truth["pose"])


def test_randomised_looks():
    envs = WalkerTrackingVector(12, clothes=True, horizon=5)
    first, _ = envs.reset(seed=0)
    assert len({truth["skeleton"].height for truth in envs.truth()}) > 8
    plain = WalkerTrackingVector(2, clothes=False, horizon=5)
    plain.reset(seed=0)
    stage = plain.world.stage
    np.testing.assert_array_equal(stage.colours[0], stage.colours[1])
    assert len(np.unique(envs.world.stage.colours[:, 1], axis=0)) == 12
    assert len(np.unique(first.reshape(12, -1), axis=0)) == 12


def made(n: int, **changed) -> Stage:
    how = {"size": 36, "scenery": Augmentation("plain", 0, 0, 0.0, 0.0), "clothes": True, "threads": 1, **changed}
    return Stage(n, Source("walk/fpca", "train", 11, 30.0), WalkingView("side", 30.0), **how)


def test_a_slots_episode_depends_on_its_generator_alone():
    many, one = made(3), made(1)
    many.begin(np.arange(3), [np.random.default_rng(seed) for seed in (5, 6, 7)])
    one.begin(np.array([0]), [np.random.default_rng(6)])
    many.time[1], one.time[0] = 4, 4
    np.testing.assert_array_equal(many.now()[1], one.now()[0])
    np.testing.assert_array_equal(many.draw(np.array([1])).rgb, one.draw(np.array([0])).rgb)
    many.begin(np.array([0, 2]), [np.random.default_rng(seed) for seed in (8, 9)])
    np.testing.assert_array_equal(many.now()[1], one.now()[0])  # others begin again, this one goes on
    assert many.time.tolist() == [0, 4, 0]


def test_a_frame_back_is_the_one_before():
    stage = made(2)
    stage.begin(np.arange(2), [np.random.default_rng(seed) for seed in (1, 2)])
    stage.time[:] = 3
    before = np.array(stage.draw(np.arange(2)).rgb)
    stage.time[:] = 4
    np.testing.assert_array_equal(stage.draw(np.arange(2), back=1).rgb, before)
    assert (np.array(stage.draw(np.arange(2)).rgb) != before).any()


def test_people_wear_colours_that_skin_and_clothes_have():
    stage = made(40)
    stage.begin(np.arange(40), [np.random.default_rng(seed) for seed in range(40)])
    assert ((stage.colours >= 0) & (stage.colours <= 1)).all()
    skin = stage.colours[:, 0]
    assert (np.diff(skin, axis=1) < 0).all()  # more red than green than blue
    assert skin[:, 0].min() < 0.45
    assert skin[:, 0].max() > 0.8


def test_settings_select_what_is_observed():
    rgb, limbs = np.arange(36 * 36 * 3, dtype=np.uint8).reshape(1, 36, 36, 3), np.zeros((1, 36, 36), np.uint8)
    limbs[0, 3, 4] = 9
    depth = np.where(limbs > 0, 2.5, FAR).astype(np.float32)
    frame, stage = Frame(rgb, depth, limbs), made(1)
    stage.draw = lambda slots, rgb: frame
    for names in (["rgb"], ["depth", "mask"], ["mask", "rgb", "depth"]):
        settings = PictureSettings(names, 36)
        seen = settings.of(stage, np.array([0]))
        assert list(seen) == names
        assert settings.rgb == ("rgb" in names)
        assert all(settings.space[name].contains(seen[name][0]) for name in names)
    assert np.argwhere(seen["mask"][0, ..., 0]).tolist() == [[3, 4]]
    assert seen["mask"].max() == 255
    assert np.isinf(PictureSettings("depth", 36).evidence(frame)["depth"][0, 0])
    assert list(PictureSettings(["rgb", "mask"], 36).evidence(frame)) == ["mask"]
    assert list(PictureSettings("rgb", 36).evidence(frame)) == ["rgb"]


def test_true_joints_are_observed_alone_or_beside_pictures():
    stage, slots = made(3), np.array([0, 2])
    stage.begin(np.arange(3), [np.random.default_rng(seed) for seed in range(3)])
    truths = np.float32([stage.truth(slot)["joints"] for slot in slots])
    alone = PictureSettings("joints", 36)
    np.testing.assert_array_equal(alone.of(stage, slots), truths)
    assert alone.space.contains(alone.of(stage, slots)[0])
    both = PictureSettings(["mask", "joints"], 36).of(stage, slots)
    np.testing.assert_array_equal(both["joints"], truths)
    np.testing.assert_array_equal(both["mask"], PictureSettings("mask", 36).of(stage, slots))
    with pytest.raises(MotionError, match="observe mask, depth or rgb, not joints alone"):
        alone.evidence(stage.draw(slots))


@pytest.mark.parametrize(("gaps", "seconds"), [(0.3, 0.15), (0.5, 0.5), (0.8, 1.0)])
def test_gaps_are_as_frequent_and_as_long_as_asked(gaps, seconds):
    """Over many episodes, the share of blank frames, and the share of them that is followed by one that isn't."""
    how = {"size": 36, "scenery": Augmentation(), "clothes": False, "threads": 1, "gaps": gaps, "gap_seconds": seconds}
    stage = Stage(400, Source("walk/fpca", "train", 91, 30.0), WalkingView("side", 30.0), **how)
    stage.begin(np.arange(400), [np.random.default_rng(seed) for seed in range(400)])
    each = stage.blank.mean(axis=1)
    assert abs(each.mean() - gaps) < 4 * each.std() / 20
    assert abs(stage.blank[:, 0].mean() - gaps) < 4 * 0.5 / 20
    before, after = stage.blank[:, :-1], stage.blank[:, 1:]
    ends = (before & ~after).sum() / before.sum()
    assert ends == pytest.approx(1 / (30 * seconds), rel=0.1)


def test_gaps_change_nothing_but_that_nothing_is_seen():
    arguments = {"observation": ["rgb", "mask", "depth"], "size": 36, "horizon": 30, "render_mode": "rgb_array"}
    plain, blind = WalkerTrackingVector(4, **arguments), WalkerTrackingVector(4, gaps=0.5, **arguments)
    (clear, _), (seen, _) = plain.reset(seed=2), blind.reset(seed=2)
    blank = blind.world.stage.blank
    for frame in range(30):
        off = blank[:, frame]
        for name, nothing in (("rgb", 0), ("mask", 0), ("depth", FAR)):
            np.testing.assert_array_equal(seen[name][~off], clear[name][~off])
            assert (seen[name][off] == nothing).all()
        if frame == 10:
            np.testing.assert_array_equal(
                np.array(blind.render())[~blank[:, 9]], np.array(plain.render())[~blank[:, 9]]
            )
        actions = plain.action_space.sample()
        (clear, rewards, *_), (seen, others, *_) = plain.step(actions), blind.step(actions)
        np.testing.assert_array_equal(rewards, others)
    assert 0.2 < blank.mean() < 0.8
    assert not plain.world.stage.blank.any()


@pytest.mark.parametrize("observation", ["mask", "depth", "rgb"])
def test_a_blank_frame_tells_nothing_about_poses(observation):
    envs = WalkerTrackingVector(6, observation=observation, size=36, horizon=10, gaps=0.5)
    envs.reset(seed=0)
    poses = np.stack([truth["pose"] for truth in envs.truth()])
    told = [np.ptp(model.log_likelihood(poses)) for model in envs.get_attr("observation_model")]
    blank = envs.world.stage.blank[:, 0]
    assert 0 < blank.sum() < 6
    np.testing.assert_allclose(np.array(told)[blank], 0.0, atol=1e-9)
    if observation != "rgb":  # whose background isn't known yet in the first frame
        assert (np.array(told)[~blank] > 1.0).all()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"gaps": 0.95}, "gaps must be"),
        ({"gap_seconds": 0.0}, "gap_seconds must be"),
        ({"gaps": 0.9, "gap_seconds": 0.01}, "gaps=0.9 is impossible with gap_seconds=0.01 at 30 frames per second"),
    ],
)
def test_gaps_that_there_can_not_be_are_refused(arguments, says):
    with pytest.raises(MotionError, match=says):
        WalkerTrackingVector(1, **arguments)
