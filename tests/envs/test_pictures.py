"""What every environment that shows pictures takes and refuses."""

import numpy as np
import pytest

from motionenv.envs import ArmTracking, WalkerTracking
from motionenv.errors import MotionError


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"size": 0}, "size"),
        ({"size": 35}, "size"),
        ({"size": 512}, "size"),
        ({"size": 64.5}, "size"),
        ({"observation": "sound"}, "observation"),
        ({"observation": ()}, "observation"),
        ({"observation": None}, "observation"),
        ({"observation": 5}, "observation"),
        ({"observation": [["rgb"]]}, "observation"),
        ({"observation": ("rgb", "rgb")}, "observation"),
        ({"camera": "above"}, "camera"),
        ({"camera": np.nan}, "camera"),
        ({"camera": True}, "camera"),
        ({"background": "beach"}, "background"),
        ({"distractors": -1}, "distractors"),
        ({"occluders": 1.5}, "occluders"),
        ({"noise": -1.0}, "noise"),
        ({"brightness": 1.0}, "brightness"),
        ({"estimate": "guess"}, "estimate"),
        ({"estimate": "belief", "n_belief": 0}, "n_belief"),
        ({"clothes": "yes"}, "clothes"),
        ({"fps": 1e9}, "fps"),
        ({"lost_after": 0.0}, "lost_after"),
        ({"lost_after": True}, "lost_after"),
        ({"lost_after": "far"}, "lost_after"),
        ({"render_mode": "ansi"}, "render_mode"),
    ],
)
@pytest.mark.parametrize("make", [WalkerTracking, ArmTracking])
def test_impossible_arguments_are_named_when_it_is_made(make, arguments, why):
    with pytest.raises(MotionError, match=why):
        make(**arguments)
