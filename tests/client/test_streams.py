"""Motion without end, as an iterator."""

import numpy as np
import pytest

from motionenv import ServiceError


def test_motion_without_end(client):
    with client.stream("walk/fpca", seed=1, fps=120, speed=1.2) as stream:
        assert (stream.fps, stream.height > 1) == (120, True)
        poses = [next(stream) for _ in range(60)]
        stream.change(speed=1.6)
        with pytest.raises(ServiceError, match="/speed: Input should be less than or equal to 3") as wrong:
            stream.change(speed=100)
        assert wrong.value.errors[0]["field"] == "/speed"
        poses += [next(stream) for _ in range(60)]
    assert np.abs(np.diff(poses, axis=0)).max() < 0.3
