"""The page computes what Python computes, within 1e-6: its modules are run by Node."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import linprog

import motionenv
from motionenv.body import limb_segments
from motionenv.data.stimuli import Display, PointLightWalker, dots_at
from motionenv.data.stimuli.making import ring
from motionenv.models import cycle
from service.formats.cycles import encoded
from service.formats.parameters import MEDIA_TYPE, packed

HERE = Path(__file__).parent
SOURCES = HERE.parents[2] / "service" / "web" / "src"
pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="needs Node: apt-get install nodejs")


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """`computed(cases)`: what the page makes of each."""
    folder = tmp_path_factory.mktemp("parity")
    names = {"walk/fpca": "walk.bin", "walk/eigenwalkers": "eigenwalkers.bin"}
    for name, file in names.items():
        (folder / file).write_bytes(packed(*motionenv.models.parameters(motionenv.load(name))))
    parameters = {name: str(folder / file) for name, file in names.items()}

    def compute(cases: list[dict]) -> list:
        asked = json.dumps({"cases": cases, "parameters": parameters})
        command = ["node", HERE / "parity.mjs", SOURCES]
        run = subprocess.run(command, input=asked, capture_output=True, text=True, check=True, timeout=60)
        return json.loads(run.stdout)

    return compute


@pytest.fixture(scope="module")
def stride(tmp_path_factory):
    """`stride(model, **how)`: the file of a stride as the service sends it, and the stride."""
    folder = tmp_path_factory.mktemp("strides")

    def make(model: str, **how):
        made = cycle(model, **how)
        file = folder / f"{len(list(folder.iterdir()))}.bin"
        file.write_bytes(encoded(made, 75.0, np.zeros(8), model, MEDIA_TYPE))
        return str(file), made

    return make


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_walkers_are_the_same(computed, stride, model):
    """At the samples of a stride, and between them, where the page's poses are a spline through them."""
    for how in ({}, {"deviations": [1.5, -0.5], "speed": 1.4, "height": 2.2}, {"deviations": [-3.0, 3.0, -3.0]}):
        file, made = stride(model, **how)
        phases = np.arange(96) / 96
        (found,) = computed([{"kind": "walker", "model": model, "stride": file, "phases": phases.tolist()}])
        np.testing.assert_allclose(np.reshape(found["markers"], made.markers.shape), made.markers, rtol=0, atol=1e-9)
        limbs = limb_segments(made.poses, made.body)
        np.testing.assert_allclose(np.reshape(found["limbs"], limbs.shape), limbs, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found["ground"], phases * made.stride, rtol=0, atol=1e-9)
        assert found["speed"] == pytest.approx(made.speed)


def test_any_pose_has_the_same_body(computed):
    """Of a tree, say: crouched, turned, with heels and toes that must stay over the ground."""
    rng = np.random.default_rng(4)
    poses = rng.uniform(-0.9, 0.9, (200, 25))
    poses[:, :3] = [0.0, 0.0, 0.8] + 0.3 * poses[:, :3]
    (found,) = computed([{"kind": "poses", "model": "walk/fpca", "poses": poses.tolist()}])
    body = motionenv.load("walk/fpca").skeleton()
    limbs = limb_segments(poses, body)
    np.testing.assert_allclose(np.reshape(found["limbs"], limbs.shape), limbs, rtol=0, atol=1e-9)


def test_between_samples_it_is_a_smooth_ring(computed):
    """Catmull-Rom: the cubic through neighbours with central differences as slopes (SciPy's Hermite spline)."""
    values = np.random.default_rng(5).standard_normal((12, 3))
    phases = np.linspace(-1.3, 2.7, 57)
    (found,) = computed([{"kind": "between", "values": values.tolist(), "phases": phases.tolist()}])
    ring = np.concatenate([values, values[:1]])
    slopes = 0.5 * (np.roll(values, -1, 0) - np.roll(values, 1, 0))
    spline = CubicHermiteSpline(np.arange(13), ring, np.concatenate([slopes, slopes[:1]]))
    np.testing.assert_allclose(found, spline((phases % 1.0) * 12), rtol=0, atol=1e-12)


DISPLAYS = [
    Display(),
    Display(view=90, turntable=45, roll=-30, rate=-1.3, phase=-0.4, inverted=True),
    Display(scrambled=True, desynchronised=True, across=3.5, seed=5),
    Display(dots=8, lifetime=0.21, mask=37, mask_size=1.9, seed=2**32 - 1),
    Display(dots=1, lifetime=0.05, mask=4, scrambled=True, rate=0, seed=12),
]


@pytest.mark.parametrize("model", ["walk/fpca", "walk/eigenwalkers"])
def test_the_dots_of_stimuli_are_the_same(computed, stride, model):
    """Also which of them are random, as NumPy's Philox draws them."""
    times = [0.0, 0.013, 0.5, 1.0, 2.39, 7.77]
    people = [({}, ()), ({"speed": 1.7, "height": 1.4}, (1.5, -0.5))]
    cases = [(display, options, deviations) for display in DISPLAYS for options, deviations in people]
    asked = [
        {"kind": "dots", "display": d.model_dump(), "stride": stride(model, deviations=z, **o)[0], "times": times}
        for d, o, z in cases
    ]
    for (display, options, deviations), found in zip(cases, computed(asked), strict=True):
        want = dots_at(display, ring(PointLightWalker(model=model, deviations=deviations, **options)), times)
        found = np.array(found)
        np.testing.assert_array_equal(found[..., 2], want.visible)
        np.testing.assert_allclose(found[..., :2], want.plane, rtol=0, atol=1e-9)


def unit(rng, *shape) -> np.ndarray:
    drawn = rng.normal(size=shape)
    return drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)


def test_what_is_held_stays_and_the_rest_moves_as_far_as_it_can(computed):
    """Against linear programming: how far a direction can go at all, with the others held and within ±3."""
    rng, cases = np.random.default_rng(0), []
    for i in range(60):
        q = int(rng.integers(1, 12))
        held = unit(rng, int(rng.integers(0, min(q + 1, 5))), q)
        start = np.clip(rng.normal(0, 1.5, q), -3, 3)
        direction = held[0] if i % 10 == 9 and len(held) else unit(rng, q)
        value = float(rng.uniform(-4, 4))
        cases.append(
            {"deviations": start.tolist(), "direction": direction.tolist(), "value": value, "held": held.tolist()}
        )
    reached = 0
    for case, z in zip(cases, computed([{"kind": "moved", **case} for case in cases]), strict=True):
        start, direction, held = (np.array(case[name]) for name in ("deviations", "direction", "held"))
        assert np.abs(z).max() <= 3 + 1e-9
        if len(held):
            np.testing.assert_allclose(held @ z, held @ start, atol=1e-6)
        equal = {"A_eq": held, "b_eq": held @ start} if len(held) else {}
        ends = [linprog(sign * direction, bounds=(-3, 3), **equal).fun * sign for sign in (1, -1)]
        best = np.clip(case["value"], *ends)
        now, then = direction @ start, direction @ z
        assert abs(best - then) <= abs(best - now) + 1e-6  # never away from what was asked
        reached += abs(best - then) < 0.05
    assert reached >= 0.8 * len(cases)  # greedy: it stops at corners that a linear program goes around
