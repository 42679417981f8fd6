"""Numbers that callers give: what counts as one, and that every entrance refuses what doesn't by its name."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.estimation import ObservationModel
from motionenv.estimation.background import Background
from motionenv.estimation.edges import EdgeModel
from motionenv.estimation.numeric import as_number, checked_whole
from motionenv.estimation.playing import play
from motionenv.estimation.product import Product
from motionenv.estimation.tracking import FPCAPrior, MixturePrior, ParticleFilter, VelocityPrior, reaching_tree, smooth
from motionenv.estimation.tracking.start import automatic_start
from motionenv.estimation.tracking.video import track_video
from motionenv.render.cameras import view

NO_WHOLE_NUMBER = ["ten", None, True, 2.5, np.nan, np.inf, [3], 0]
CAMERA = view(0.0, width=32, height=32)


@pytest.mark.parametrize("value", [3, 3.0, np.int32(3), np.float32(3)])
def test_whole_numbers(value):
    whole = checked_whole(value, "n", 1, 3)
    assert whole == 3
    assert type(whole) is int


@pytest.mark.parametrize("value", NO_WHOLE_NUMBER)
def test_what_is_no_whole_number(value):
    with pytest.raises(MotionError, match="n must be a whole number from 1"):
        checked_whole(value, "n", 1)
    with pytest.raises(MotionError, match="from 1 to 9"):
        checked_whole(value, "n", 1, 9)


def test_what_is_no_number_is_within_no_limits():
    assert as_number(np.float32(0.5)) == as_number(0.5) == 0.5
    assert all(np.isnan(as_number(value)) for value in ("0.5", None, True, [0.5]))


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda v: smooth([None], FPCAPrior(), n=v), "n"),
        (lambda v: automatic_start(None, [{}], n=v), "n"),
        (lambda v: automatic_start(None, [{}], candidates=v), "candidates"),
        (lambda v: reaching_tree(clips=v), "clips"),
        (lambda v: reaching_tree(seconds=v), "seconds"),
        (lambda v: track_video("none.mp4", attempts=v), "attempts"),
        (lambda v: track_video("none.mp4", particles=v), "n"),
        (lambda v: track_video("none.mp4", seconds=v), "seconds"),
        (lambda v: ParticleFilter(FPCAPrior(), None, v), "n"),
        (lambda v: ParticleFilter(FPCAPrior(), None, resample=v), "resample"),
        (lambda v: ParticleFilter(FPCAPrior(), None, hidden=v), "hidden"),
        (lambda v: MixturePrior(FPCAPrior(), VelocityPrior(skeleton=FPCAPrior().skeleton), v), "share"),
        (lambda v: play(None, None, v), "episodes"),
        (lambda v: Background(least=v), "least"),
        (lambda v: ObservationModel(CAMERA, misses=v), "misses"),
        (lambda v: EdgeModel(CAMERA, outliers=v), "outliers"),
        (lambda v: Product([ObservationModel(CAMERA)], outliers=v), "outliers"),
    ],
)
def test_words_are_refused_by_name_at_every_entrance(call, name):
    with pytest.raises(MotionError, match=rf"\b{name} .*'ten'"):
        call("ten")
