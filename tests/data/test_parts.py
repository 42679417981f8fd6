"""Parts of a data set: nobody is in two of them."""

import numpy as np
import pytest

from motionenv.data import Sampler, Specification, split
from motionenv.errors import MotionError


def test_parts_have_other_people_each_and_the_shares_that_were_asked_for():
    spec = Specification(frames=400, output={"fields": ["joints"]}, people={"views": 2})
    parts = split(spec, (0.8, 0.1, 0.1))
    assert {name: part.frames for name, part in parts.items()} == {"train": 320, "validation": 40, "test": 40}
    people, bodies = {}, {}
    for name, part in parts.items():
        samples = list(Sampler(part).samples(0, part.samples))
        people[name] = {int(sample["walker"]) for sample in samples}
        bodies[name] = {np.linalg.norm(np.diff(s["joints"][[9, 11, 13]], axis=0), axis=1).tobytes() for s in samples}
        assert [int(sample["index"]) for sample in samples] == list(range(part.samples))
    for one, other in (("train", "test"), ("train", "validation"), ("validation", "test")):
        assert not people[one] & people[other]
        assert not bodies[one] & bodies[other]
    whole = Sampler(spec).sample(0)
    assert np.array_equal(Sampler(parts["train"]).sample(0)["joints"], whole["joints"])


@pytest.mark.parametrize("shares", [(0.5,), (0.9, 0.2), (1.0, 0.0), (0.25, 0.25, 0.25, 0.25), (0.5, "half")])
def test_other_shares_are_refused(shares):
    with pytest.raises(MotionError, match="shares must be 2 or 3 numbers above 0 that are 1 in all"):
        split(Specification(), shares)
