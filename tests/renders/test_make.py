"""The fixtures in renders/ come back: poses from the seed, pictures from the poses, and their truth is true."""

import json

import numpy as np
import pytest
from PIL import Image

from motionenv.body import LIMBS
from motionenv.types import MARKERS
from renders import make

RAYCAST = [name for name, fixture in make.FIXTURES.items() if fixture.engine == "raycast"]
PYRENDER = [name for name, fixture in make.FIXTURES.items() if fixture.engine == "pyrender"]


def png(name: str) -> np.ndarray:
    with Image.open(make.HERE / f"{name}.png") as image:
        return np.asarray(image)


@pytest.mark.parametrize("name", make.FIXTURES)
def test_the_seed_gives_the_same_walk_and_the_same_cameras(name):
    """To 1e-9, not to the bit: linear algebra libraries round differently on different CPUs."""
    motion, views, arrays = make.stored(name)
    again = make.walk(make.FIXTURES[name])
    np.testing.assert_allclose(again.poses, motion.poses, rtol=0, atol=1e-9)
    np.testing.assert_allclose(again.skeleton.offsets, motion.skeleton.offsets, rtol=0, atol=1e-9)
    np.testing.assert_allclose(again.skeleton.radii, motion.skeleton.radii, rtol=0, atol=1e-9)
    for one, other in zip(make.cameras(make.FIXTURES[name], again), views, strict=True):
        np.testing.assert_allclose(one.t, other.t, rtol=0, atol=1e-9)
        np.testing.assert_allclose(one.R, other.R, rtol=0, atol=1e-12)
    assert json.loads(str(arrays["made_by"]))["seed"] == make.FIXTURES[name].seed


@pytest.mark.parametrize("name", RAYCAST)
def test_raycast_draws_the_same_pictures_to_the_bit(name):
    motion, views, arrays = make.stored(name)
    frame = make.draw(make.FIXTURES[name], motion, views)
    np.testing.assert_array_equal(make.picture(make.FIXTURES[name], frame), png(name))
    again = make.truth(name, motion, views, frame)
    for key in ("depth", "limbs", "marker_names", "limb_names", "made_by"):
        assert (key in again) == (key in arrays)
        np.testing.assert_array_equal(again.get(key, 0), arrays.get(key, 0))
    for key in ("markers", "pixels"):
        np.testing.assert_allclose(again[key], arrays[key], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", PYRENDER)
@pytest.mark.usefixtures("opengl")
def test_pyrender_draws_nearly_the_same_pictures(name):
    """Drivers place samples and filter shadows in their own ways: edges differ, areas hardly."""
    motion, views, _ = make.stored(name)
    again = make.picture(make.FIXTURES[name], make.draw(make.FIXTURES[name], motion, views))
    difference = np.abs(again.astype(int) - png(name)).max(-1)
    assert difference.mean() < 1.0
    assert (difference > 16).mean() < 0.01


@pytest.mark.parametrize("name", make.FIXTURES)
def test_pixels_are_where_the_camera_sees_the_markers(name):
    """By homogeneous coordinates, written out."""
    _, _, arrays = make.stored(name)
    for i, t in enumerate(arrays["t"]):
        p = arrays["K"] @ np.column_stack([arrays["R"], t])
        x = np.column_stack([arrays["markers"][i], np.ones(15)]) @ p.T
        np.testing.assert_allclose(x[:, :2] / x[:, 2:], arrays["pixels"][i], rtol=0, atol=1e-9)
        assert ((arrays["pixels"][i] >= 0) & (arrays["pixels"][i] <= arrays["size"] - 1)).all()


def test_masks_show_a_limb_in_front_of_every_marker():
    """Joint centres lie inside the body, so what is seen there is the body, and nearer than the centre."""
    _, views, arrays = make.stored("masks")
    assert ((arrays["limbs"] > 0) == np.isfinite(arrays["depth"])).all()
    for i, camera in enumerate(views):
        column, row = arrays["pixels"][i].round().astype(int).T
        assert (arrays["limbs"][i, row, column] > 0).all()
        assert (arrays["depth"][i, row, column] < camera.project(arrays["markers"][i])[1]).all()
        head = arrays["limbs"][i, row[MARKERS.index("head")], column[MARKERS.index("head")]]
        assert LIMBS[head - 1] == "head"


def test_point_lights_shine_at_the_markers_and_nowhere_else():
    _, _, arrays = make.stored("points")
    picture = png("points").reshape(160, 8, 120, 3).swapaxes(0, 1)
    rows, columns = np.mgrid[:160, :120]
    for image, pixels in zip(picture, arrays["pixels"], strict=True):
        column, row = pixels.round().astype(int).T
        assert (image[row, column] > 250).all()
        away = np.hypot(columns[..., None] - pixels[:, 0], rows[..., None] - pixels[:, 1]).min(-1)
        assert (image[away > 3] == 0).all()


def test_two_sizes_look_their_size():
    """The same camera: the body's height in pixels goes with its height in metres."""
    heights = {}
    for name in ("short", "tall"):
        motion, views, _ = make.stored(name)
        limbs = make.render(motion.poses, motion.skeleton, views, rgb=False).limbs
        heights[name] = np.mean([np.ptp(np.flatnonzero(mask.any(1))) + 1 for mask in limbs > 0])
        assert motion.skeleton.height == make.FIXTURES[name].height
    assert heights["tall"] / heights["short"] == pytest.approx(1.95 / 1.55, rel=0.04)


def test_the_folder_is_small_and_its_table_names_every_fixture():
    assert sum(p.stat().st_size for p in make.HERE.iterdir() if p.is_file()) < 1.5e6
    table = (make.HERE.parent / "README.md").read_text(encoding="utf-8")
    assert all(f"| `{name}` |" in table for name in make.FIXTURES)
