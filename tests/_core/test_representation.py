"""What is seen at the prompt and in notebooks: one line, and small pictures that browsers can read."""

import base64
import io
import re
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import motionenv
from motionenv._core.representation import OneLine, listed, short
from motionenv.errors import FitWarning
from motionenv.render import render
from motionenv.types import POSE, Camera, Cycles, Markers, Motion, Points


@pytest.fixture(scope="module")
def walk() -> Motion:
    return motionenv.synthesize("walk/fpca", 1, 30, seed=1, height=1.75)


@pytest.fixture(scope="module")
def camera(walk) -> Camera:
    return motionenv.fit_view(motionenv.markers(walk.poses, walk.skeleton), alpha=0.0, width=64, height=48)


def lacking(walk: Motion) -> Motion:
    poses = walk.poses.copy()
    poses[3:, POSE.index("left_knee_flexion")] = np.nan
    return Motion(poses, walk.skeleton, 29.97)


def test_records_say_what_they_hold_on_one_line(walk, camera):
    points = motionenv.markers(walk.poses, walk.skeleton)
    cycles = Cycles(np.zeros((5, 128, 2)), ("a", "b"), np.ones(5), np.zeros(5, int), tuple("xxyyz"))
    assert repr(walk) == "Motion(30 frames, 30 fps, 1.75 m, 'walk')"
    assert repr(lacking(walk)) == "Motion(30 frames, 29.97 fps, 1.75 m, with gaps)"
    assert repr(Motion(walk.poses[None, :1], walk.skeleton, 30)) == "Motion(1 x 1 frames, 30 fps, 1.75 m)"
    assert repr(walk.skeleton) == "Skeleton(1.75 m)"
    assert repr(Markers(("a",), points[:, :1], 30)) == "Markers(30 frames, 1 point, 30 fps)"
    assert repr(Points(points[..., :2], 30, "m", name="x")) == "Points(30 frames, 30 fps, in m, 'x')"
    assert repr(cycles) == "Cycles(5 cycles of 3 people, 128 samples, 2 channels)"
    assert re.fullmatch(r"Camera\(64x48, focal length \S+ pixels, at \(\S+, \S+, \S+\) m\)", repr(camera))
    frame = render(walk.poses[:2], walk.skeleton, camera)
    assert repr(frame) == "Frame(2 frames, 64x48, rgb, depth and limbs)"
    assert repr(render(walk.poses[0], walk.skeleton, camera, rgb=False)) == "Frame(64x48, depth and limbs)"


def test_models_show_the_settings_that_are_not_the_default():
    assert repr(motionenv.FunctionalPCA()) == "FunctionalPCA()"
    assert repr(motionenv.FunctionalPCA(n_components=3, centre="person")) == (
        "FunctionalPCA(n_components=3, centre='person')"
    )
    assert repr(motionenv.load("walk/fpca")) == "WalkingModel(n_components=8)"


def test_other_records_name_fields_and_shapes_and_end_in_time():
    @dataclass(repr=False)
    class Some(OneLine):
        array: np.ndarray
        number: float
        absent: str = ""
        label: str = "x" * 80

    assert repr(Some(np.zeros((3, 4)), 1 / 3)) == f"Some(array=array(3, 4), number=0.3333, label='{'x' * 26}...)"
    assert listed({f"name{i}": i for i in range(30)}).endswith(", ...")
    assert len(listed({f"name{i}": i for i in range(30)})) <= 118
    assert (short(np.zeros(3)), short(tuple(range(40))), short((1, 2))) == ("array(3)", "<40 values>", "(1, 2)")


def shown(html: str) -> ElementTree.Element:
    """The parsed HTML; it is well-formed XML."""
    return ElementTree.fromstring(html)


def test_a_motion_is_a_strip_of_stick_figures(walk):
    figure = shown(walk._repr_html_())
    assert figure.findtext("figcaption") == repr(walk)
    lines = [[float(x) for x in re.split("[ ,]", line.get("points"))] for line in figure.iter("polyline")]
    assert len(lines) == 8 * 14  # lines between 15 markers
    x, y = np.array([line[0::2] for line in lines]), np.array([line[1::2] for line in lines])
    assert np.all((x > 0) & (x < 800) & (y > 0) & (y < 150))
    assert len(list(shown(lacking(walk)._repr_html_()).iter("polyline"))) < len(lines)
    unknown = Motion(np.full((3, 25), np.nan), walk.skeleton, 30)
    assert not list(shown(unknown._repr_html_()).iter("polyline"))


def test_cycles_are_curves():
    values = np.random.default_rng(1).normal(size=(5, 16, 3))
    values[:, 4:6, 1] = np.nan
    cycles = Cycles(values, ("a", "b", "<c>"), np.ones(5), np.zeros(5, int), tuple("xxyyz"))
    assert len(list(shown(cycles._repr_html_()).iter("polyline"))) == 4  # the second has a gap
    model = motionenv.FunctionalPCA(n_components=1, n_harmonics=3)
    assert model._repr_html_() is None
    with pytest.warns(FitWarning, match="b: 2 of 16 phases"):
        model.fit(cycles)
    assert len(list(shown(model._repr_html_()).iter("polyline"))) == 3


@pytest.mark.parametrize("rgb", [True, False])
def test_frames_are_pictures_side_by_side(walk, camera, rgb):
    frame = render(walk.poses[::10], walk.skeleton, camera, rgb=rgb)
    source = shown(frame._repr_html_()).find("img").get("src")
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(source.partition(",")[2]))))
    expected = frame.rgb if rgb else np.repeat((frame.limbs > 0)[..., None] * np.uint8(255), 3, -1)
    np.testing.assert_array_equal(picture, np.concatenate(expected, axis=1))
