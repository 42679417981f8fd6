"""Speed, agreement and memory of the raycaster and of pyrender (EGL), on the same scene in the same run.

    motionenv bench render

pyrender draws colour and depth in one pass, ids and depth in another (its segmentation pass), and only the first is
counted where ids are in brackets: its time is that of both passes less that of the second. Times include kinematics.
"""

import resource
import sys
import timeit
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_erosion

from benchmarks import Arguments, Skipped, headline
from motionenv.body import from_height
from motionenv.errors import EngineError
from motionenv.render import Raycaster, Scene
from motionenv.render.cameras import view
from motionenv.render.opengl.engine import PyrenderRenderer

SKELETON = from_height()
SIZES = ((64, 64), (128, 128), (640, 480))
TINY = ((64, 64), (200, 20))
PLAIN, SHADOWS = Scene(shadows=False), Scene()


def walking(n: int) -> np.ndarray:
    """Poses (n, 25) with arms and legs swinging as in walking, plus noise."""
    rng = np.random.default_rng(0)
    phase = np.linspace(0, 20 * np.pi, n)
    poses = np.zeros((n, 25))
    poses[:, 2] = 0.53 * SKELETON.height
    for side, at in ((1, 17), (-1, 21)):
        poses[:, at] = side * 0.4 * np.sin(phase)
        poses[:, at + 3] = 0.5 + 0.4 * np.cos(phase * side)
        poses[:, at - 8] = -side * 0.4 * np.sin(phase)
        poses[:, at - 5] = 0.4
    return poses + 0.02 * rng.normal(size=poses.shape) * (np.arange(25) > 5)


def rate(draw, poses: np.ndarray, repeats: int = 3) -> float:
    """Poses rendered per second, the best of a few runs."""
    draw(poses[:2])
    return len(poses) / min(timeit.repeat(lambda: draw(poses), number=1, repeat=repeats))


def raycast(scene: Scene, camera, *, rgb: bool, threads: int, n: int) -> float:
    """Frames per second of the raycaster into a reused frame."""
    caster, poses = Raycaster(scene, threads=threads), walking(n)
    out = caster.render(poses, SKELETON, camera, rgb=rgb)
    return rate(lambda p: caster.render(p, SKELETON, camera, rgb=rgb, out=out if len(p) == n else None), poses)


def speed(renderers: dict[Scene, PyrenderRenderer], quick: bool) -> None:
    """Print frames per second and ratios."""
    print(
        "| pictures/s | size | pyrender EGL | raycast, 1 thread | ratio | raycast, 2 threads | ratio |\n|-|-|-|-|-|-|-|"
    )
    rows = (
        ("RGB + depth (+ ids)", PLAIN, True),
        ("the same with shadows", SHADOWS, True),
        ("depth + ids", PLAIN, False),
    )
    for name, scene, rgb in rows:
        for width, height in TINY if quick else SIZES:
            camera = view(0.5, width=width, height=height)
            few, many = (2, 20) if quick else (40, 6000) if width < 200 else (12, 200)
            draw = renderers[scene].render
            both, second = (
                1 / rate(lambda p, d=draw, c=camera, k=k: d(p, SKELETON, c, rgb=k), walking(few), repeats=2)
                for k in (True, False)
            )
            theirs = 1 / (max(both - second, 0.1 * both) if rgb else second)
            ours = [raycast(scene, camera, rgb=rgb, threads=t, n=many) for t in (1, 2)]
            cells = " | ".join(f"{x:,.0f} | **{x / theirs:,.0f}×**" for x in ours)
            print(f"| {name} | {width}×{height} | {theirs:,.0f} | {cells} |", flush=True)
            if (name, width) == (rows[0][0], 64):
                headline(images=ours[0], ratio=ours[0] / theirs)


def agreement(pyrender: PyrenderRenderer, quick: bool) -> None:
    """Print the differences between the two engines' pictures."""
    print("\n| size | ids, of image | ids, of body | IoU | depth, median | colour inside, max |\n|-|-|-|-|-|-|")
    poses = walking(1 if quick else 6)
    for width, height in TINY[:1] if quick else SIZES:
        a, b = (
            [engine.render(poses, SKELETON, view(alpha, width=width, height=height)) for alpha in (0, 0.8, np.pi / 2)]
            for engine in (Raycaster(PLAIN), pyrender)
        )
        ids, other = (np.concatenate([f.limbs for f in x]) for x in (a, b))
        depth, rgb = ([np.concatenate([getattr(f, k) for f in x]) for x in (a, b)] for k in ("depth", "rgb"))
        body, union = (ids > 0) & (other > 0), (ids > 0) | (other > 0)
        same = body & (ids == other)
        inside = np.zeros_like(body)
        for i in range(len(ids)):
            for limb in range(1, len(SKELETON.radii) + 1):
                inside[i] |= binary_erosion(same[i] & (ids[i] == limb), np.ones((3, 3)))
        colour = np.abs(rgb[0].astype(int) - rgb[1])[inside].max()
        wrong, gap = ids != other, np.abs(depth[0][same] - depth[1][same])
        print(
            f"| {width}×{height} | {100 * wrong.mean():.3f} % | {100 * wrong.sum() / union.sum():.2f} % | "
            f"{body.sum() / union.sum():.4f} | {1e3 * np.median(gap):.2f} mm | {colour}/255 |"
        )


def memory(pyrender: PyrenderRenderer, rounds: int) -> None:
    """Print the memory of the process before and after rounds of 500 frames (pyrender: a tenth in colour)."""
    print("\n| engine | frames | resident before | after |\n|-|-|-|-|")
    camera, poses = view(0.5, width=64, height=64), walking(500 if rounds > 1 else 10)
    caster = Raycaster(PLAIN)
    for name, draw, colour in (("raycast", caster.render, rounds), ("pyrender", pyrender.render, rounds // 10)):
        draw(poses, SKELETON, camera)
        before = resident()
        for i in range(rounds):
            draw(poses, SKELETON, camera, rgb=i < colour)
        print(f"| {name} | {rounds * len(poses):,} | {before:.0f} MB | {resident():.0f} MB |", flush=True)


def resident() -> float:
    """Resident memory of this process [MB]; its peak on systems without /proc."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * resource.getpagesize() / 1e6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def main() -> None:
    """Print the tables."""
    quick = Arguments(__doc__).parse_args().quick
    renderers = {scene: PyrenderRenderer(scene) for scene in (PLAIN, SHADOWS)}
    try:
        renderers[PLAIN].render(walking(1), SKELETON, view(0.5, width=64, height=64))
    except EngineError as error:
        raise Skipped(str(error)) from None
    speed(renderers, quick)
    agreement(renderers[PLAIN], quick)
    memory(renderers[PLAIN], 1 if quick else 20)
    for renderer in renderers.values():
        renderer.close()


if __name__ == "__main__":
    main()
