"""Made-up films of a walker among other things that move, with the truth: material for `benchmarks.tracking.choosing`.

A person of random gait, heading, distance and height crosses a textured picture of 416 × 312 pixels in three seconds at
20 frames per second. The film's kind adds what may mislead a tracker:

    alone     nothing else moves
    waving    somebody else moves arms and trunk in place, on the ground or on a roof
    walker    somebody else walks, elsewhere or in front; the person meant is given by a point
    thing     a box or ball crosses the picture
    tree      a bush sways
    nobody    a thing or a tree, and no person
    turning   the camera pans, tilts, zooms or shakes by hand

Half of the films have one to three occluders, which leave the walker clear in at least 40 % of the frames. All have
noise and MP4 compression, a third changing light.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from motionenv.models.synthesis import synthesize
from motionenv.render import Scene, render
from motionenv.render.cameras import look_at
from motionenv.render.video.encode import write_video
from motionenv.types import Camera, Skeleton

_UNIT = 2  # pixels; sizes of things and blur are multiples of it
FPS, SECONDS, WIDTH, HEIGHT = 20, 3.0, 208 * _UNIT, 156 * _UNIT
KINDS = ("waving", "walker", "alone", "thing", "waving", "tree", "nobody", "walker", "turning", "waving")
FRAMES = round(FPS * SECONDS)
_EDGE = 48 * _UNIT  # pixels beyond the picture's sides that a moving camera may show


@dataclass(frozen=True)
class MadeFilm:
    """A film and its truth.

    Attributes:
        kind: see above.
        pictures: uint8 (T, height, width, 3).
        whole: bool (T, height, width), the walker's outline as if nothing hid it.
        shown: the same, where it's visible.
        poses: of the walker (T, 25); None if nobody walks.
        skeleton: the walker's.
        camera: of the pictures; meaningless if it moves.
        other: bool (T, height, width), the outline of what else moves.
    """

    kind: str
    pictures: np.ndarray
    whole: np.ndarray
    shown: np.ndarray
    poses: np.ndarray | None
    skeleton: Skeleton
    camera: Camera
    other: np.ndarray

    def write(self, path: Path) -> None:
        """Write the pictures as an MP4 file."""
        write_video(path, iter(self.pictures), FPS)


def made_film(seed: int, kind: str | None = None) -> MadeFilm:
    """The film of a seed.

    Args:
        seed: from 0; every tenth film has the same kind.
        kind: one of `KINDS`; None takes that of the seed.
    """
    rng, kind = np.random.default_rng([15, seed]), kind or KINDS[seed % len(KINDS)]
    camera = _camera(rng)
    poses, skeleton, (limbs, depth, colours) = _walker(rng, camera)
    pictures = np.repeat(_texture(rng)[None].astype(np.float32), FRAMES, axis=0)
    scene = [] if kind == "nobody" else [(limbs, depth, colours)]
    drawn = rng.choice(("thing", "tree")) if kind == "nobody" else kind
    other = _other(drawn, rng, camera)
    if other is not None:
        scene.append(other)
    nearest = np.full(limbs.shape, np.inf)
    owner = np.zeros(limbs.shape, dtype=int)
    for number, (labels, far, colours) in enumerate(scene, 1):
        front = (labels > 0) & (far < nearest)
        pictures = np.where(front[..., None], colours, pictures)
        nearest, owner = np.where(front, far, nearest), np.where(front, number, owner)
    whole, mine = limbs > 0, (owner == 1 if kind != "nobody" else np.zeros(limbs.shape, dtype=bool))
    for region, colour in _occluders(rng, whole) if seed // 10 % 2 else ():
        pictures[:, region], mine[:, region] = colour, False
    if rng.random() < 1 / 3:
        pictures = pictures * (1 + 0.06 * np.sin(np.arange(FRAMES) / 9 + rng.uniform(0, 6)))[
            :, None, None, None
        ].astype(np.float32)
    if kind == "turning":
        pictures = _turned(pictures, rng)
    cut = (slice(None), slice(_EDGE, -_EDGE), slice(_EDGE, -_EDGE))
    noise = rng.standard_normal(pictures[cut].shape, dtype=np.float32)
    pictures = np.clip(pictures[cut] + rng.uniform(1, 6) * noise, 0, 255).astype(np.uint8)
    seen = _cropped(camera)
    others = (other[0] > 0)[cut] if other is not None else np.zeros(mine[cut].shape, dtype=bool)
    kept = None if kind == "nobody" else poses
    return MadeFilm(kind, pictures, whole[cut], mine[cut], kept, skeleton, seen, others)


def _walker(rng: np.random.Generator, camera: Camera):
    """Poses, body and `_drawn` of somebody who is in the picture, with its margin, for 60 % of the film."""
    while True:
        poses, skeleton = _walk(rng)
        drawn = _drawn(poses, skeleton, camera, rng)
        body = drawn[0] > 0
        inside, least = body[:, 2:-2, 2:-2].sum(axis=(1, 2)), 60 * _UNIT**2
        if (inside > 0.9 * np.maximum(body.sum(axis=(1, 2)), least)).sum() > 0.6 * FRAMES:
            return poses, skeleton, drawn


def _camera(rng: np.random.Generator) -> Camera:
    """A camera 3.5 to 7.5 m from the origin, at 1 to 2.5 m, with a margin of `_EDGE` pixels."""
    far, eye = rng.uniform(3.5, 7.5), rng.uniform(1.0, 2.5)
    wide, tall = WIDTH + 2 * _EDGE, HEIGHT + 2 * _EDGE
    inner = rng.uniform(36, 48)
    fov = float(np.degrees(2 * np.arctan(np.tan(np.radians(inner) / 2) * tall / HEIGHT)))
    aim = (rng.uniform(-0.3, 0.3), 0, rng.uniform(0.7, 1.2))
    return look_at((0, -far, eye), aim, width=wide, height=tall, fov_degrees=fov)


def _cropped(camera: Camera) -> Camera:
    K = camera.K.copy()
    K[:2, 2] -= _EDGE
    return Camera(K, camera.R, camera.t, WIDTH, HEIGHT)


def _walk(rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
    """A walk of random heading, through a random point near the origin at a random moment."""
    walk = synthesize("walk/fpca", SECONDS, FPS, seed=int(rng.integers(2**31)), height=float(rng.normal(1.72, 0.08)))
    return _placed(walk.poses, rng.uniform(0, 2 * np.pi), rng.uniform(-0.7, 0.7, 2), int(rng.integers(15, 45))), (
        walk.skeleton
    )


def _placed(poses: np.ndarray, heading: float, place: np.ndarray, moment: int) -> np.ndarray:
    """Poses turned by `heading` that pass `place` in frame `moment`."""
    c, s = np.cos(heading), np.sin(heading)
    poses = poses.copy()
    poses[:, :2] = (poses[:, :2] - poses[moment, :2]) @ [[c, s], [-s, c]] + place
    poses[:, 5] += heading
    return poses


def dressed(rng: np.random.Generator) -> Scene:
    """A scene in which the body has random clothes, and skin from dark to light."""
    shirt, trousers, shoes, hair = (tuple(colour) for colour in rng.uniform(0.05, 0.95, (4, 3)))
    skin = tuple(rng.uniform(0.4, 1.0) * np.array([0.9, 0.7, 0.58]))
    return Scene(skin=skin, shirt=shirt, trousers=trousers, shoes=shoes, hair=hair, samples=2)


def _drawn(poses: np.ndarray, skeleton: Skeleton, camera: Camera, rng: np.random.Generator):
    """Limbs, depth [m] (T, height, width) and colours of somebody in random clothes."""
    seen = render(poses, skeleton, camera, scene=dressed(rng))
    limbs = np.asarray(seen.limbs).astype(int)
    return limbs, np.where(limbs > 0, np.asarray(seen.depth), np.inf), np.asarray(seen.rgb)


def _texture(rng: np.random.Generator) -> np.ndarray:
    """A background (height, width, 3) of structure at several scales."""
    shape = (HEIGHT + 2 * _EDGE, WIDTH + 2 * _EDGE, 3)
    sum_ = sum(gaussian_filter(rng.standard_normal(shape), (s, s, 0.3)) * s for s in _UNIT * np.array([1.5, 4, 12, 30]))
    return np.clip(rng.uniform(80, 160) + 30 * sum_ / sum_.std(), 0, 255)


def _other(kind: str, rng: np.random.Generator, camera: Camera):
    """Labels, depth and colours of what else moves; None if nothing does."""
    if kind == "waving":
        return _drawn(*_waving(rng), camera, rng)
    if kind == "walker":
        poses, skeleton = _walk(rng)
        poses[:, 1] += rng.choice([-1.2, 1.5, 2.5])
        return _drawn(poses, skeleton, camera, rng)
    if kind == "thing":
        return _thing(rng)
    if kind == "tree":
        return _tree(rng)
    return None


def _waving(rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
    """Somebody who stays in place, on the ground or on a roof, and moves arms, trunk and a leg at random rhythms."""
    walk = synthesize("walk/fpca", SECONDS, FPS, seed=int(rng.integers(2**31)), height=float(rng.normal(1.72, 0.08)))
    poses = np.repeat(walk.poses[:1], FRAMES, axis=0)
    time = np.arange(FRAMES) / FPS
    roof = rng.random() < 0.5
    poses[:, 0] = rng.choice([-1, 1]) * rng.uniform(0.6, 2.2)
    poses[:, 1] = rng.uniform(2, 6) if roof else rng.uniform(-1.0, 3.0)
    poses[:, 2] += rng.uniform(1.0, 2.0) if roof else 0.0
    poses[:, 5] = rng.uniform(0, 2 * np.pi)
    for joint in (3, 4, *range(9, 17), 17, 20):
        size = 0.12 if joint < 5 else 0.15 if joint > 16 else rng.uniform(0.2, 1.1)
        wave = np.sin(2 * np.pi * rng.uniform(0.3, 1.6) * time + rng.uniform(0, 6))
        poses[:, joint] += size * wave
    poses[:, 5] += 0.5 * np.sin(2 * np.pi * rng.uniform(0.2, 0.6) * time)
    poses[:, :2] += 0.06 * np.sin(2 * np.pi * rng.uniform(0.2, 0.5, 2) * time[:, None])
    return poses, walk.skeleton


def _grid() -> tuple[np.ndarray, np.ndarray]:
    return np.mgrid[: HEIGHT + 2 * _EDGE, : WIDTH + 2 * _EDGE]


def _thing(rng: np.random.Generator):
    """A box (car, parcel) or ball that crosses the picture."""
    rows, columns = _grid()
    high, wide = _UNIT * rng.uniform(12, 40), _UNIT * rng.uniform(14, 70)
    speed = rng.choice([-1, 1]) * _UNIT * rng.uniform(30, 110) / FPS
    across = _EDGE + WIDTH / 2 + speed * (np.arange(FRAMES) - FRAMES / 2)
    bounce = _UNIT * rng.uniform(0, 20) * np.abs(np.sin(np.arange(FRAMES) / 4))
    down = _EDGE + rng.uniform(0.32, 0.87) * HEIGHT + bounce
    u, v = (columns - across[:, None, None]) / wide * 2, (rows - down[:, None, None]) / high * 2
    inside = (u**2 + v**2 < 1) if rng.random() < 0.5 else (np.abs(u) < 1) & (np.abs(v) < 1)
    return inside.astype(int), np.where(inside, rng.choice([3.0, 30.0]), np.inf), rng.integers(0, 255, 3)


def _tree(rng: np.random.Generator):
    """A bush whose outline sways about its root."""
    rows, columns = _grid()
    high, wide = _UNIT * rng.uniform(40, 110), _UNIT * rng.uniform(8, 22)
    root, at = _EDGE + HEIGHT - _UNIT * rng.uniform(5, 60), _EDGE + rng.choice([0.12, 0.88]) * WIDTH
    sway = _UNIT * rng.uniform(4, 14) * np.sin(2 * np.pi * rng.uniform(0.3, 1.2) * np.arange(FRAMES) / FPS)
    up = (root - rows) / high
    inside = (np.abs(columns - at - sway[:, None, None] * up**2) < wide * (1.2 - up)) & (up > 0) & (up < 1)
    return inside.astype(int), np.where(inside, 30.0, np.inf), rng.integers(0, 255, 3)


def _occluders(rng: np.random.Generator, whole: np.ndarray):
    """Regions (height, width) in front of everything, and their colours: posts, a wall or bench.

    They leave the outline `whole` (T, height, width) clear in at least 40 % of the frames.
    """
    while True:
        regions = list(_random_occluders(rng))
        hidden = np.any([region for region, _ in regions], axis=0)
        if ((whole & hidden).sum(axis=(1, 2)) < 0.05 * whole.sum(axis=(1, 2)).clip(1)).mean() > 0.4:
            return regions


def _random_occluders(rng: np.random.Generator):
    """One to three random ones."""
    rows, columns = _grid()
    for _ in range(rng.integers(1, 4)):
        if rng.random() < 0.6:
            at, half = _EDGE + rng.uniform(0.15, 0.85) * WIDTH, _UNIT * rng.uniform(2, 14)
            region = np.abs(columns - at) < half
        else:
            at, half = _EDGE + rng.uniform(0.2, 0.8) * WIDTH, _UNIT * rng.uniform(10, 40)
            down = _EDGE + _UNIT * rng.uniform(105, 145)
            region = (np.abs(columns - at) < half) & (np.abs(rows - down) < _UNIT * rng.uniform(5, 14))
        yield region, rng.integers(0, 255, 3)


def _turned(pictures: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Pictures by a camera that pans and tilts steadily, zooms, or shakes."""
    rows, columns = _grid().astype(float)
    time, how = np.arange(FRAMES) / FRAMES - 0.5, rng.choice(["pan", "zoom", "shake"])
    shift, zoom = np.zeros((FRAMES, 2)), np.ones(FRAMES)
    if how == "pan":
        shift = _UNIT * time[:, None] * [rng.uniform(-15, 15), rng.choice([-1, 1]) * rng.uniform(25, 80)]
    elif how == "zoom":
        zoom = 1 + rng.choice([-1, 1]) * rng.uniform(0.15, 0.35) * time
    else:
        shift = gaussian_filter(rng.standard_normal((FRAMES, 2)), (4, 0))
        shift *= _UNIT * rng.uniform(3, 8) / shift.std()
    middle = np.array(rows.shape)[:, None, None] / 2
    turned = np.empty_like(pictures)
    for i, picture in enumerate(pictures):
        at = (np.stack([rows, columns]) - middle) * zoom[i] + middle + shift[i][:, None, None]
        for c in range(3):
            turned[i, ..., c] = map_coordinates(picture[..., c], at, order=1, mode="reflect")
    return turned
