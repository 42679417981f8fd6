"""Gymnasium's RecordVideo makes a film of an episode; it needs MoviePy."""

import av
import gymnasium
import pytest
from gymnasium.wrappers import RecordVideo

pytest.importorskip("moviepy", reason="MoviePy is missing: pip install -e '.[integrations]'")

import motionenv.envs  # noqa: F401 (registers the environments)

pytestmark = pytest.mark.integration

IDS = ["motionenv/WalkerTracking-v1", "motionenv/MarkerTracking-v1", "motionenv/ArmTracking-v1"]


@pytest.mark.parametrize("name", IDS)
def test_a_film_of_an_episode(name, tmp_path):
    made = gymnasium.make(name, render_mode="rgb_array", horizon=12)
    with RecordVideo(made, str(tmp_path / "films"), disable_logger=True) as env:
        env.action_space.seed(0)
        env.reset(seed=0)
        for _ in range(12):
            ended = env.step(env.action_space.sample())[3]
        assert ended
        height, width, _ = env.render().shape
    (film,) = tmp_path.glob("films/*.mp4")
    with av.open(film) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(pictures) in (12, 13)  # MoviePy loses the last one to rounding now and then
    assert {picture.shape for picture in pictures} == {(height, width, 3)}
    assert any((picture != pictures[0]).any() for picture in pictures)
