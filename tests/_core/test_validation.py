"""Numbers that callers give: what counts as one, and that every entrance refuses what doesn't by its name."""

import numpy as np
import pytest

from motionenv._core.validation import checked_choice, checked_number, checked_range, checked_whole, random_generator
from motionenv.envs.agents.evaluation import evaluate
from motionenv.errors import MotionError
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.likelihoods.background import Background
from motionenv.render.cameras import view
from motionenv.tracking import Film, FPCAPrior, ParticleFilter, track_video
from motionenv.tracking.initialization import automatic_start

NO_WHOLE_NUMBER = ["ten", None, True, 2.5, np.nan, np.inf, [3], 0]
CAMERA = view(0.0, width=32, height=32)


@pytest.mark.parametrize("value", [3, 3.0, np.int32(3), np.float32(3)])
def test_whole_numbers(value):
    whole = checked_whole(value, "n", 1, 3)
    assert whole == 3
    assert type(whole) is int


def test_large_whole_numbers_are_exact():
    assert checked_whole(2**64 - 1, "key", 0, 2**64 - 1) == 2**64 - 1
    with pytest.raises(MotionError, match="key"):
        checked_whole(2**64, "key", 0, 2**64 - 1)


@pytest.mark.parametrize("value", NO_WHOLE_NUMBER)
def test_what_is_no_whole_number(value):
    with pytest.raises(MotionError, match="n must be a whole number from 1"):
        checked_whole(value, "n", 1)
    with pytest.raises(MotionError, match="from 1 to 9"):
        checked_whole(value, "n", 1, 9)


@pytest.mark.parametrize(
    ("value", "limits", "message"),
    [
        (3.5, {"low": 0.1, "high": 3, "unit": "m/s"}, "x must be a number of m/s from 0.1 to 3, got 3.5"),
        ("ten", {"low": 0.1, "high": 3, "unit": "m/s"}, "x must be a number of m/s from 0.1 to 3, got 'ten'"),
        (True, {"low": 0}, "x must be a number from 0, got True"),
        (1, {"low": 0, "below": 1}, "x must be a number at least 0 and below 1, got 1"),
        (0.0, {"above": 0, "below": 1}, "x must be a number above 0 and below 1, got 0.0"),
        (0, {"above": 0, "high": 1}, "x must be a number above 0 and at most 1, got 0"),
        (np.inf, {"low": 0}, "x must be a number from 0, got inf"),
        (np.nan, {}, "x must be a finite number, got nan"),
        ([1], {}, r"x must be a finite number, got [1]"),
    ],
)
def test_numbers_out_of_their_limits(value, limits, message):
    with pytest.raises(MotionError) as refused:
        checked_number(value, "x", **limits)
    assert str(refused.value) == message


@pytest.mark.parametrize("value", [0.5, np.float32(0.5)])
def test_numbers(value):
    number = checked_number(value, "x", 0, 1)
    assert number == 0.5
    assert type(number) is float


@pytest.mark.parametrize("value", [3, (1,), (2, 1), (0, 9), ("1", "2"), "12", None, (np.nan, 1), (True, 2)])
def test_what_is_no_range(value):
    with pytest.raises(MotionError, match=r"x must be two numbers of m \(low, high\) from 1 to 5, got"):
        checked_range(value, "x", 1, 5, "m")


def test_ranges():
    assert checked_range([1, np.float32(5)], "x", 1, 5) == (1.0, 5.0)


@pytest.mark.parametrize("seed", [-1, 1.5, "one", [-1]])
def test_a_seed_that_numpy_refuses_is_refused_by_name(seed):
    with pytest.raises(MotionError, match="seed must be None, a whole number from 0 or a numpy Generator"):
        random_generator(seed)


def test_a_generator_is_taken_as_it_is():
    rng = np.random.default_rng(1)
    assert random_generator(rng) is rng
    assert random_generator(1).random() == np.random.default_rng(1).random()


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda v: automatic_start(None, [{}], n=v), "n"),
        (lambda v: automatic_start(None, [{}], candidates=v), "candidates"),
        (lambda v: track_video("none.mp4", particles=v), "n"),
        (lambda v: Film("none.mp4", seconds=v), "seconds"),
        (lambda v: ParticleFilter(FPCAPrior(), None, v), "n"),
        (lambda v: ParticleFilter(FPCAPrior(), None, resample=v), "resample"),
        (lambda v: ParticleFilter(FPCAPrior(), None, hidden=v), "hidden"),
        (lambda v: evaluate(None, None, v), "episodes"),
        (lambda v: Background(frames=v), "frames"),
        (lambda v: SilhouetteLikelihood(CAMERA, misses=v), "misses"),
    ],
)
def test_words_are_refused_by_name_at_every_entrance(call, name):
    with pytest.raises(MotionError, match=rf"\b{name} .*'ten'"):
        call("ten")


def test_a_choice_suggests_the_nearest_word():
    assert checked_choice("raycast", "engine", ("raycast", "pyrender")) == "raycast"
    with pytest.raises(
        MotionError, match=r"engine must be one of raycast, pyrender, got 'raykast': did you mean raycast\?"
    ):
        checked_choice("raykast", "engine", ("raycast", "pyrender"))
    with pytest.raises(MotionError, match="got None$"):
        checked_choice(None, "engine", ("raycast",))
