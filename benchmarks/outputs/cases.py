"""The outputs that `benchmarks.outputs` saves and compares: small, quick and deterministic.

Functions import what they need, so that a moved module breaks only its own outputs.
"""

import functools
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import motionenv

#: Functions that compute outputs, by name; those in `CAPTURED` take the folder of motion capture.
OUTPUTS: dict[str, Callable[[], Any]] = {}
CAPTURED: dict[str, Callable[[Path], Any]] = {}


def output(name: str, *given, **asked) -> Callable:
    """Register a function with arguments as an output. Can be stacked."""

    def register(make: Callable) -> Callable:
        OUTPUTS[name] = functools.partial(make, *given, **asked)
        return make

    return register


def captured(name: str, *given, **asked) -> Callable:
    """Register a function with arguments as an output that needs motion capture; it also gets the folder."""

    def register(make: Callable) -> Callable:
        CAPTURED[name] = functools.partial(make, *given, **asked)
        return make

    return register


@functools.cache
def walk(seconds: float = 2.0, seed: int = 7) -> motionenv.Motion:
    """A synthesised walk."""
    return motionenv.synthesize("walk/fpca", seconds, 30, seed=seed, speed=1.3, height=1.75)


@functools.cache
def tree() -> Any:
    """The ready-made tree."""
    return motionenv.load("mixed/tree")


def camera(alpha: float = 0.4, size: int = 64) -> motionenv.Camera:
    """A small camera that looks at the origin."""
    from motionenv.render import cameras

    return cameras.view(alpha, distance=4.0, width=size, height=size)


def near(pose: np.ndarray, n: int = 50) -> np.ndarray:
    """Hypotheses (n, 25) about a pose."""
    return pose + 0.1 * np.random.default_rng(1).standard_normal((n, 25))


def gappy() -> motionenv.Cycles:
    """Cycles of eight people, with a gap in one channel."""
    people = [walk(4.0, seed) for seed in range(8)]
    angles = [person.angles.copy() for person in people]
    angles[0][40:55, 3] = np.nan
    return motionenv.segment(angles, fps=30, subjects=[f"person {i}" for i in range(8)])


def markers_of(motion: motionenv.Motion) -> motionenv.Markers:
    """The 15 markers of a motion."""
    from motionenv.types import MARKERS

    return motionenv.Markers(MARKERS, motionenv.markers(motion.poses, motion.skeleton), motion.fps)


# ── models ────────────────────────────────────────────────────────────────────────────────────────────────────────────


@output("motion walk/fpca", "walk/fpca", seed=7)
@output("motion walk/fpca without variation", "walk/fpca", seed=12, variation=0.0)
@output("motion walk/fpca fast, tall", "walk/fpca", seed=3, speed=1.9, height=1.95)
@output("motion walk/fpca slow, small", "walk/fpca", seed=4, speed=0.6, height=1.2, phase=0.25)
@output("motion walk/fpca deviations", "walk/fpca", seed=3, deviations=(1.0, -0.5), phase=0.5, variation=2.0)
@output("motion walk/fpca scores", "walk/fpca", seed=3, scores=(0.4, -0.2, 0.1))
@output("motion walk/eigenwalkers", "walk/eigenwalkers", seed=7)
@output("motion walk/eigenwalkers speed, height", "walk/eigenwalkers", seed=8, speed=1.6, height=1.6)
@output("motion walk/eigenwalkers deviations", "walk/eigenwalkers", deviations=(2.0, -1.0), phase=0.3)
@output("motion walk/eigenwalkers scores", "walk/eigenwalkers", scores=(0.1, 0.2))
@output("motion walk/prior", "walk/prior", seed=7)
@output("motion walk/prior deviations", "walk/prior", deviations=(-1.0, 0.5), speed=1.1)
@output("motion mixed/tree", "mixed/tree", seed=1)
@output("motion mixed/tree speed, height", "mixed/tree", seed=2, speed=1.5, height=1.9)
def _motion(model: str, **asked) -> Any:
    return motionenv.synthesize(model, 2.0, 30, **asked)


@output("walkers of walk/fpca, a batch")
def _batch() -> Any:
    model = motionenv.load("walk/fpca")
    stride = model.sample(3, seed=5, speed=1.2)
    batch = model.walks(1.0, 60, n=20, seed=3)
    own = model.walks(1.0, 120, n=3, stride=stride, seed=1, phase=0.5)
    return {"batch": batch, "stride": stride, "own": own, "seconds": model.stride_seconds(stride.scores)}


@output("walkers of walk/eigenwalkers", "walk/eigenwalkers")
@output("walkers of walk/prior", "walk/prior")
def _walkers(name: str) -> Any:
    model = motionenv.load(name)
    walkers = model.sample(3, seed=2)
    scores = model.transform(walkers)
    walker = model.walker(4)
    phases = 2 * np.pi * (float(model.frequency(walker.scores)) * np.arange(30) / 30)
    treadmill = model.gait_of(walker).motion(phases, 30, overground=False, name="eigenwalker")
    return [walkers, scores, model.frequency(scores), model.score_samples(scores), treadmill,
            model.gait_of(walker).positions(phases), model.score(walkers)]  # fmt: skip


@output("walking in place")
def _in_place() -> Any:
    from motionenv.models import cycle
    from motionenv.models.eigenwalkers.batch import draw_walkers

    troje = motionenv.load("walk/eigenwalkers")
    return [cycle("walk/fpca"), cycle(troje), draw_walkers(troje, 4, seed=1)]


@output("traits of walk/fpca", "walk/fpca")
@output("traits of walk/eigenwalkers", "walk/eigenwalkers")
def _traits(name: str) -> Any:
    from motionenv.models.traits import measured, traits

    model = motionenv.load(name)
    made = model.components(), model.treadmill()
    found = traits(*made)
    return {"traits": found, "measured": measured(*made, 2 * np.array([t.direction for t in found]))}


@output("parameters of walk/fpca", "walk/fpca")
@output("parameters of walk/eigenwalkers", "walk/eigenwalkers")
@output("parameters of walk/prior", "walk/prior")
@output("parameters of mixed/tree", "mixed/tree")
def _parameters(name: str) -> Any:
    from motionenv.models import card

    arrays, description = motionenv.models.parameters(name)
    for later in ("about", "treadmill", "steerable"):
        del description[later]
    for key in ("shares", "traits", "activities"):
        if not description[key]:
            del description[key]
    return {"card": json.dumps(card(name), sort_keys=True), "parameters": (arrays, description)}


@output("file of walk/fpca", "walk/fpca")
@output("file of walk/prior", "walk/prior")
def _model_file(name: str) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.npz"
        motionenv.load(name).save(path, {"data": "none"})
        return path.read_bytes()


@output("FunctionalPCA of cycles with gaps, ppca", "ppca")
@output("FunctionalPCA of cycles with gaps, svd", "svd")
def _fpca(method: str) -> Any:
    cycles = gappy()
    model = motionenv.FunctionalPCA(n_components=3, n_harmonics=10, method=method).fit(cycles)
    scores = model.transform(cycles.values)
    slopes = model.evaluate(scores, np.linspace(0, 1, len(scores)), derivative=1)
    drawn, filled = model.sample(3, seed=1), model.impute(cycles.values)
    return [model.to_arrays()[0], filled, drawn, scores, slopes, model.score_samples(cycles)]


@output("Eigenwalkers of markers", "Eigenwalkers", n_components=3)
@output("WalkerPrior of markers", "WalkerPrior", n_components=3)
def _fitted_walkers(kind: str, **how) -> Any:
    people = [markers_of(walk(4.0, seed)) for seed in range(8)]
    names = [str(i) for i in range(8)]
    return getattr(motionenv, kind)(**how).fit(people, names).to_arrays()[0]


@output("WalkingModel of walks")
def _fitted_walking() -> Any:
    people = [walk(4.0, seed) for seed in range(8)]
    model = motionenv.WalkingModel(n_components=3).fit(people, [str(i) for i in range(8)])
    return [model.to_arrays()[0], model.score(people), model.synthesize(1.0, 30, seed=1)]


# ── tree ──────────────────────────────────────────────────────────────────────────────────────────────────────────────


@output("tree samples, tree", method="tree")
@output("tree samples, tree, kernel leaves", method="tree", leaf="kernel", carry=True)
@output("tree samples, exact", method="exact")
@output("tree samples, exact, carried, noise", method="exact", carry=True, noise=0.5, temperature=1.0)
def _samples(**how) -> Any:
    drawn = tree().sample(walk().poses, n=40, seed=1, **{"temperature": 0.2} | how)
    return [drawn, tree().source(drawn.windows), tree().leaf(drawn.windows)]


@output("tree coefficients and history")
def _tree_numbers() -> Any:
    from motionenv.models.motion_tree import history

    poses = walk().poses
    return [tree().coefficients(poses), history(tree(), "walk", seed=3)]


@output("tree growth steered")
def _growth() -> Any:
    from motionenv.models.motion_tree import MotionGenerator, Options, Target

    growth = MotionGenerator(tree(), "walk", seed=2, options=Options(temperature=0.1, method="tree", noise=0.2))
    ahead = growth.step(30)
    growth.target = Target(heading=1.5, speed=1.2)
    return [ahead, growth.step(60), growth.windows]


@output("tree growth after a history", contact=False, future=False, candidates=4)
@output("tree growth by name", start="slow walk")
def _grown(start: str | None = None, **options) -> Any:
    return tree().generator(walk().poses if start is None else start, seed=1, **options).motion(2.0)


@output("tree of one's own, its forecast, halves")
def _own_tree() -> Any:
    from motionenv.models.motion_tree import Clip, build_database

    database = build_database([Clip(walk(4.0, seed), activity="walk") for seed in range(4)], mirrored=True)
    trees = {
        part: motionenv.MotionTree(part=part).fit_database(database) for part in ("body", "lower", "upper", "right_arm")
    }
    grown = trees["lower"].generator(upper=trees["upper"], seed=1).motion(1.0)
    fitted = {part: [one.to_arrays()[0], one.forecast_] for part, one in trees.items()}
    return {"database": database, "trees": fitted, "grown": grown}


# ── cycles and body ───────────────────────────────────────────────────────────────────────────────────────────────────


@output("cycles of walks with gaps")
def _cycles() -> Any:
    return gappy()


@output("cycle length, SNR and alignment")
def _period() -> Any:
    from motionenv.cycles import align, estimate_period, snr

    angles = [walk(4.0, seed).angles for seed in range(3)]
    periods = [estimate_period(z, 30) for z in angles]
    aligned = align(angles, [p.frames for p in periods])
    return [periods, snr(angles[0], np.arange(20.0, 60.0), weighting="paper"), aligned]


@output("gait of a walk")
def _gait() -> Any:
    from motionenv.models.walking import preprocessing

    motion = walk(4.0)
    return [
        preprocessing.gait_channels(motion),
        preprocessing.find_cycles(motion),
        preprocessing.forward_speed(motion),
        preprocessing.straightness(motion),
    ]


@output("body: joints, limbs, feet, mesh")
def _body() -> Any:
    from motionenv import body

    poses, skeleton = near(walk().poses[0], 5), walk().skeleton
    mesh = body.body_mesh(poses[0], skeleton, sections=8)
    bodies = [body.from_height(1.5, girth=1.2), body.limit_excess(poses), body.mirror(poses)]
    where = [f(poses, skeleton) for f in (body.forward, body.markers, body.limb_segments, body.feet)]
    return [where, bodies, np.asarray(mesh.vertices), np.asarray(mesh.faces)]


# ── metrics ───────────────────────────────────────────────────────────────────────────────────────────────────────────


@output("metrics of points and walkers")
def _metrics() -> Any:
    from benchmarks.lifting import walker_errors
    from motionenv import metrics

    truth, estimate = (markers_of(walk(2.0, seed)).positions for seed in (7, 8))
    by_point = [f(estimate, truth) for f in (metrics.mpjpe, metrics.pelvis_mpjpe, metrics.aligned_mpjpe)]
    names = ("joint_error", "walker_error", "relative_joint_error", "relative_walker_error")
    by_walker = [getattr(walker_errors, name)(estimate[..., 0], truth[..., 0], frames=True) for name in names]
    cycles = np.random.default_rng(1).normal(0, 0.2, (2, 3, 5, 15, 3))
    missing = walker_errors.missing_variance(truth[..., 1], frames=True)
    return [by_point, by_walker, missing, walker_errors.cycle_mpjpe(*cycles)]


@output("metrics of beliefs")
def _belief_metrics() -> Any:
    from motionenv import metrics

    rng = np.random.default_rng(4)
    belief = rng.normal(size=(6, 40, 15, 3)), rng.normal(size=(6, 40)), rng.normal(size=(6, 15, 3))
    scores = [metrics.energy_score(*belief), metrics.energy_score(*belief, fair=True)]
    return [scores, metrics.credible_level(*belief, seed=1), metrics.coverage(*belief, 0.9, seed=1)]


# ── files ─────────────────────────────────────────────────────────────────────────────────────────────────────────────


@output("file BVH", "bvh")
@output("file GLB", "glb")
@output("file C3D", "c3d")
@output("file CSV", "csv")
@output("file NPZ", "npz")
def _file(suffix: str) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"walk.{suffix}"
        motionenv.write(walk(), path)
        back = motionenv.read(path) if suffix in ("bvh", "c3d", "npz") else None
        fitted = motionenv.retarget(back) if isinstance(back, motionenv.Markers) else None
        return {"bytes": path.read_bytes(), "read": back, "retargeted": fitted}


_BANDAI = "bandai_namco/Bandai-Namco-Research-Motiondataset-1/data/"


@captured("capture BVH, Bandai", f"{_BANDAI}dataset-1_walk-left_tired_001.bvh")
@captured("capture BVH, CMU", "cmu_bvh_misc/02_01.bvh", unit="cmu")
@captured("capture AMC, CMU", "cmu_asfamc/07/07_01.amc", fps=120)
@captured("capture C3D, CMU", "cmu_c3d/02_01.c3d")
@captured("capture C3D, Plug-in Gait", "btkdata/C3DSamples/PiG/PiG_Motion-FlatFoot-Hole.c3d")
@captured("capture TRC", "btkdata/TRCSamples/MOTEK/ballet_reduced.trc")
def _capture(name: str, mocap: Path, **how) -> Any:
    markers = motionenv.read(mocap / name, **how)
    return {"read": markers, "motion": motionenv.retarget(markers)}
