"""Motion without end goes on smoothly when it is changed."""

import numpy as np

import motionenv
from motionenv.models.motion_tree import MotionGenerator, Options, Target
from service.responses.streaming import Stream
from service.schemas.stream import StreamSettings


def test_a_tree_is_steered_as_it_goes():
    tree = motionenv.load("mixed/tree")
    settings = StreamSettings(model="mixed/tree", seed=3)
    stream = Stream(lambda _: tree, settings)
    growth = MotionGenerator(tree, seed=[3, 0], options=Options(temperature=settings.temperature))
    for change, target in (({}, Target()), ({"heading": 60.0, "speed": 1.5}, Target(None, np.radians(60), 1.5))):
        stream.change(settings.model_copy(update=change))
        growth.target = target
        assert np.array_equal([stream.next() for _ in range(40)], growth.step(40))
