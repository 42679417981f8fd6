"""Published norms of step parameters."""

import pytest

from motionenv.errors import MotionError
from motionenv.gait import norms_for


def test_an_age_finds_its_group():
    """Anchors that abstracts state: 143.4 cm/s of men in their forties, 94.3 cm/s of women of 80 to 99 years."""
    speed = lambda age, sex: [n.mean for n in norms_for(age, sex) if n.name == "speed"]
    assert speed(40, "male") == speed(49.9, "male") == [1.434]
    assert speed(85, "female") == [0.943]
    assert speed(35, None) == [1.337, 1.433]
    assert speed(6.5, "female") == [1.2]  # children's are not parted
    assert speed(17, "male") == speed(100, "male") == speed(5, None) == []
    children = next(n for n in norms_for(12) if n.name == "stride_time")
    assert (children.mean, children.sd) == (1.059, 0.063)
    assert all(n.source and n.youngest <= 12 <= n.oldest for n in norms_for(12))
    assert norms_for(None) == ()


@pytest.mark.parametrize(
    ("age", "sex", "words"),
    [(-1, None, "age must be a number of years"), (130, None, "to 120"), (30, "m", "female or male, got 'm'"),
     (None, "male", "give age=")],
)  # fmt: skip
def test_other_values_are_refused(age, sex, words):
    with pytest.raises(MotionError, match=words):
        norms_for(age, sex)
