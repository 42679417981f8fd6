"""Scenes: directions become unit vectors, colours linear light, and what can't be drawn is named."""

import numpy as np
import pytest

from motionenv.body import LIMBS
from motionenv.errors import MotionError
from motionenv.render.scene import Scene, linear


def test_lights_come_from_where_they_were_put_with_the_strength_that_was_given():
    scene = Scene(key=(0, 3, 4), key_light=(1, 2, 3), fill=(0, 0, 9))
    np.testing.assert_allclose(scene.lights[0], [0, 0.6, 0.8, 1, 2, 3])
    np.testing.assert_allclose(scene.lights[1, :3], [0, 0, 1])
    assert Scene(key=(0, 0.3, 0.4), key_light=(1, 2, 3), fill=(0, 0, 1)) == scene


def test_limbs_wear_their_clothes():
    scene = Scene(skin=(1, 0, 0), shirt=(0, 1, 0), trousers=(0, 0, 1), shoes=(1, 1, 1))
    worn = dict(zip(LIMBS, scene.limb_colours, strict=True))
    for limb, colour in (
        ("head", [1, 0, 0]),
        ("left_hand", [1, 0, 0]),
        ("right_upper_arm", [0, 1, 0]),
        ("torso", [0, 1, 0]),
        ("left_shin", [0, 0, 1]),
        ("right_foot", [1, 1, 1]),
    ):
        np.testing.assert_array_equal(worn[limb], colour)


def test_half_as_bright_to_the_eye_is_about_a_fifth_of_the_light():
    np.testing.assert_allclose(linear([0.0, 0.5, 1.0]), [0, 0.2176, 1], atol=1e-4)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ({"samples": 5}, r"Scene\.samples must be 1, 2, 3 or 4, got 5"),
        ({"key": (0, 0, -1)}, r"Scene\.key must be a direction with z > 0, got \(0, 0, -1\)"),
        ({"key": (1, 0, 0)}, r"Scene\.key must be a direction"),
        ({"fill": (0, 1)}, r"Scene\.fill must be a direction with z > 0"),
        ({"fill": (0, 0, np.nan)}, r"Scene\.fill"),
        ({"tile": 0}, r"Scene\.tile must be a number of metres above 0, got 0"),
        ({"fade": -1.0}, r"Scene\.fade must be a number of metres above 0, got -1\.0"),
    ],
)
def test_what_can_not_be_drawn_is_named(bad, says):
    with pytest.raises(MotionError, match=says):
        Scene(**bad)
