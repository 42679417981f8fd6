"""Other processors give the same models, motions and pictures, as docs/conventions.md says.

Subprocesses are told to use other kernels of OpenBLAS, and to compile for other processors.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import motionenv
from motionenv.models.motion_tree.database import Clip, build_database
from motionenv.render import render
from tests.models.eigenwalkers.test_group_axis import people
from tests.models.eigenwalkers.walks import hide, stride, walker
from tests.models.fpca.made_cycles import as_cycles, low_rank, with_gaps

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
BLAS = [{"OPENBLAS_CORETYPE": name} for name in ("Nehalem", "Haswell")]  # older than all that have AVX-512
NUMBA = [{"NUMBA_CPU_NAME": name} for name in ("generic", "haswell")]


def fits():
    """Names and fitted models."""
    walkers, groups, _ = people(5.0, n=8)
    labels = [f"p{i}" for i in range(len(walkers))]
    yield "eigenwalkers of low rank", motionenv.Eigenwalkers().fit(walkers, labels, groups=groups)
    made = [walker(i) for i in range(10)]
    yield "eigenwalkers", motionenv.Eigenwalkers().fit(made)
    some = [hide(w, [4 + i % 3]) if i % 2 else w for i, w in enumerate(made)]
    yield "eigenwalkers with gaps", motionenv.Eigenwalkers(4).fit(some)
    yield "prior", motionenv.WalkerPrior().fit(made[:6])
    cycles = as_cycles(with_gaps(low_rank()[0])[0])
    for method in ("ppca", "svd"):
        yield method, motionenv.FunctionalPCA(3, 6, method=method).fit(cycles)
    walks = [motionenv.synthesize("walk/fpca", 6, 30, seed=i, height=1.75) for i in range(5)]
    yield "walking", motionenv.WalkingModel().fit(walks)
    clips = [Clip(walk, f"walk {i}", "walk", str(i)) for i, walk in enumerate(walks)]
    yield "tree", motionenv.MotionTree().fit_database(build_database(clips))


def save_models(path: str) -> None:
    arrays = {}
    for name, model in fits():
        for key, array in model.to_arrays()[0].items():
            arrays[f"{name}: {key}"] = array
        if axis := getattr(model, "axis_", None):
            arrays[f"{name}: axis"] = np.array([axis.mean, axis.gain, *axis.right])
    np.savez(path, **arrays)


def save_motions(path: str) -> None:
    """Motions of shipped models, and pictures of a given motion by a given camera."""
    names = ("walk/fpca", "walk/eigenwalkers", "walk/prior")
    poses = {name: motionenv.synthesize(name, 4, 30, seed=3, speed=1.3).poses for name in names}
    camera = motionenv.Camera(
        [[150, 0, 79.5], [0, 150, 59.5], [0, 0, 1]], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [0, 0.9, 3], 160, 120
    )
    frame = render(stride()[::30], motionenv.from_height(1.75), camera)
    np.savez(path, **poses, rgb=frame.rgb, depth=frame.depth, limbs=frame.limbs)


def made(save: str, path: Path, setting: dict[str, str]) -> dict[str, np.ndarray]:
    """What one of the functions above saves in a process with a `setting` of the environment."""
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("OPENBLAS_", "NUMBA_CPU_"))}
    code = f"from tests.contracts.test_processors import {save}; {save}({str(path)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=inherited | setting, check=True, timeout=900)
    with np.load(path) as file:
        return dict(file)


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """The same in a process without settings."""
    folder = tmp_path_factory.mktemp("here")
    return {save: made(save, folder / f"{save}.npz", {}) for save in ("save_models", "save_motions")}


@pytest.mark.parametrize("setting", BLAS, ids=str)
def test_models_are_the_same_with_another_blas(here, tmp_path, setting):
    found, expected = made("save_models", tmp_path / "models.npz", setting), here["save_models"]
    assert found.keys() == expected.keys()
    for name, array in expected.items():
        scale = np.abs(array[np.isfinite(array)]).max(initial=0)
        np.testing.assert_allclose(found[name], array, rtol=0, atol=float(1e-9 * scale), err_msg=name)


@pytest.mark.parametrize("setting", [*BLAS, *NUMBA], ids=str)
def test_motions_are_the_same_but_for_rounding_and_pictures_to_the_bit(here, tmp_path, setting):
    found, expected = made("save_motions", tmp_path / "motions.npz", setting), here["save_motions"]
    assert (expected["limbs"] > 0).mean() > 0.02
    for name, array in expected.items():
        if array.ndim == 2:
            np.testing.assert_allclose(found[name], array, rtol=0, atol=1e-13, err_msg=name)
        else:
            np.testing.assert_array_equal(found[name], array, err_msg=name)
