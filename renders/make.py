"""Remake the fixtures: `python renders/make.py [NAME ...] [--out DIR]`; README.md says what they hold.

Each fixture is NAME.png, the pictures side by side, and NAME.npz, the truth. The NPZ is a motion file of motionenv
(so `motionenv render side.npz` films it again) with more arrays in it; `truth` says which.
"""

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from motionenv.body import LIMBS, markers
from motionenv.mocap import read_motion, write
from motionenv.models.synthesis import synthesize
from motionenv.render import Scene, render
from motionenv.render.cameras import follow, project, view
from motionenv.render.draw2d.point_lights import render_points
from motionenv.types import MARKERS, Camera, Frame, Motion

HERE = Path(__file__).parent / "fixtures"
FRAMES, FPS, SPEED, WIDTH, HEIGHT = 8, 8.0, 1.3, 120, 160
SCENE = Scene(samples=2)


@dataclass(frozen=True)
class Fixture:
    """A walk and how it is seen.

    Attributes:
        what: for people.
        seed: of the synthesis.
        degrees: view angle α; 0 is the side view, 90 frontal.
        height: of the body [m].
        model: whose walk it is.
        engine: "raycast" or "pyrender".
        shows: "body", "points" (point lights), or "masks" (limb ids above depth).
    """

    what: str
    seed: int
    degrees: float
    height: float = 1.75
    model: str = "walk/fpca"
    engine: str = "raycast"
    shows: str = "body"


FIXTURES = {
    "side": Fixture("from the side", 1, 0),
    "front": Fixture("from the front", 2, 90),
    "oblique": Fixture("obliquely from the front", 10, 40),
    "short": Fixture("a person of 1.55 m", 4, 20, height=1.55),
    "tall": Fixture("the same walk at 1.95 m, by the same camera", 4, 20, height=1.95),
    "points": Fixture("point lights at the 15 markers", 5, 30, model="walk/eigenwalkers", shows="points"),
    "masks": Fixture("limb ids above depth, brighter is nearer", 6, 60, shows="masks"),
    "pyrender": Fixture("the walk of `oblique` drawn by OpenGL", 10, 40, engine="pyrender"),
}


def walk(fixture: Fixture) -> Motion:
    """The walk (8, 25) of a fixture: one second."""
    f = fixture
    return synthesize(f.model, FRAMES / FPS, FPS, seed=f.seed, speed=SPEED, height=f.height)


def cameras(fixture: Fixture, motion: Motion) -> tuple[Camera, ...]:
    """One camera per frame, 3.4 m beside the walker and as fast."""
    alpha = np.radians(fixture.degrees)
    placed = view(alpha, distance=3.4, eye_height=1.25, target=(0, 0, 0.95), width=WIDTH, height=HEIGHT)
    return follow(motion, placed)


def draw(fixture: Fixture, motion: Motion, views: tuple[Camera, ...]) -> Frame:
    """The pictures of a fixture; point lights have no depth and no limbs."""
    if fixture.shows == "points":
        rgb = render_points(markers(motion.poses, motion.skeleton), views, radius=1.6)
        return Frame(rgb, np.empty(0, np.float32), np.empty(0, np.uint8))
    return render(motion.poses, motion.skeleton, views, scene=SCENE, engine=fixture.engine)


def picture(fixture: Fixture, frame: Frame) -> np.ndarray:
    """What NAME.png shows, uint8 (height, width, 3): all frames in a row."""
    if fixture.shows != "masks":
        return np.concatenate(list(frame.rgb), axis=1)
    colours = (60 + np.arange(len(LIMBS) + 1)[:, None] * [97, 61, 151] % 196).astype(np.uint8)  # apart, never dark
    colours[0] = 0
    seen = np.isfinite(frame.depth)
    near, far = frame.depth[seen].min(), frame.depth[seen].max()
    grey = np.where(seen, 255 - 190 * (np.where(seen, frame.depth, far) - near) / (far - near), 0).astype(np.uint8)
    rows = colours[frame.limbs], np.repeat(grey[..., None], 3, axis=-1)
    return np.concatenate([np.concatenate(list(row), axis=1) for row in rows])


def truth(name: str, motion: Motion, views: tuple[Camera, ...], frame: Frame) -> dict[str, np.ndarray]:
    """The arrays of NAME.npz besides the motion's own (poses, offsets, radii, height, fps).

    - `made_by`: JSON with the command and the fixture's row of the table.
    - `marker_names` (15,), `markers` (8, 15, 3) [m], `pixels` (8, 15, 2) [pixels; centres at whole numbers].
    - `K` (3, 3), `R` (3, 3), `t` (8, 3), `size` (width, height): the camera of each frame, in OpenCV's convention.
    - `limb_names` (17,); for fixtures of masks `depth` float32 [m] and `limbs` uint8, both (8, height, width).
    """
    seen = markers(motion.poses, motion.skeleton)
    made_by = {"command": f"python renders/make.py {name}", "speed": SPEED, **asdict(FIXTURES[name])}
    arrays = {
        "made_by": np.array(json.dumps(made_by, sort_keys=True)),
        "marker_names": np.array(MARKERS),
        "markers": seen,
        "pixels": project(seen, views)[0],
        "K": views[0].K,
        "R": views[0].R,
        "t": np.stack([v.t for v in views]),
        "size": np.array([WIDTH, HEIGHT]),
        "limb_names": np.array(LIMBS),
    }
    masks = {"depth": frame.depth, "limbs": frame.limbs} if FIXTURES[name].shows == "masks" else {}
    return arrays | masks


def stored(name: str, folder: Path = HERE) -> tuple[Motion, tuple[Camera, ...], dict[str, np.ndarray]]:
    """Motion, cameras and all arrays of a fixture on disk."""
    with np.load(folder / f"{name}.npz") as file:
        arrays = dict(file)
    width, height = arrays["size"]
    views = tuple(Camera(arrays["K"], arrays["R"], t, width, height) for t in arrays["t"])
    return read_motion(folder / f"{name}.npz"), views, arrays


def make(name: str, out: Path) -> None:
    """Write NAME.png and NAME.npz to the folder `out`."""
    fixture = FIXTURES[name]
    motion = walk(fixture)
    views = cameras(fixture, motion)
    frame = draw(fixture, motion, views)
    path = out / f"{name}.npz"
    write(motion, path)
    with np.load(path) as file:
        arrays = dict(file)
    np.savez_compressed(path, **arrays, **truth(name, motion, views, frame))
    Image.fromarray(picture(fixture, frame)).save(out / f"{name}.png", optimize=True)


def main() -> None:
    """Make the fixtures named on the command line, or all."""
    parser = argparse.ArgumentParser(description="Remake fixtures.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(FIXTURES)}; all when none is given")
    parser.add_argument("--out", type=Path, default=HERE, help="folder to write to")
    asked = parser.parse_args()
    if unknown := set(asked.names) - set(FIXTURES):
        parser.error(f"no fixture is called {', '.join(sorted(unknown))}; there are: {', '.join(FIXTURES)}")
    asked.out.mkdir(parents=True, exist_ok=True)
    for name in asked.names or FIXTURES:
        make(name, asked.out)


if __name__ == "__main__":
    main()
