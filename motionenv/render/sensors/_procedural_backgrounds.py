"""Procedural photographs and sprites: backgrounds and moving distractors.

Photographs have the properties that make real ones hard for trackers: a 1/f spectrum, edges at all scales (walls,
windows, shelves, boxes, poles), textures, shadows, uneven light, and the colours of skin and clothes. They are
generated from fixed seeds when first requested, once per size and process.
"""

from functools import cache, lru_cache

import numpy as np
from scipy.ndimage import gaussian_filter

from motionenv.body.limbs import COLOURS, from_height
from motionenv.render.cameras import look_at
from motionenv.render.raycast.multi_body import WORN, MultiBodyRaycaster, outfits
from motionenv.render.sensors.photographs import Bank

_SCENES = 16  # photographs before mirroring
_SEED = 20260303

#: Number of people among the sprites, and images of each one's gait cycle.
PEOPLE, PHASES = 8, 8
_EACH = 8
#: Sprites of objects, by kind.
OBJECTS = {
    kind: tuple(range(PEOPLE * PHASES + _EACH * i, PEOPLE * PHASES + _EACH * (i + 1)))
    for i, kind in enumerate(("carts", "posts", "boxes", "bushes"))
}

# Colours of rooms, streets and objects (sRGB, 0 to 1), including the body's own.
_PALETTE = np.array([
    *COLOURS.values(),
    (0.93, 0.91, 0.86), (0.75, 0.72, 0.66), (0.55, 0.53, 0.5), (0.35, 0.34, 0.33), (0.14, 0.14, 0.15),  # greys
    (0.5, 0.33, 0.2), (0.36, 0.23, 0.14), (0.66, 0.5, 0.34), (0.6, 0.3, 0.25), (0.72, 0.55, 0.46),  # wood, brick
    (0.68, 0.22, 0.2), (0.8, 0.64, 0.28), (0.25, 0.42, 0.25), (0.38, 0.5, 0.3), (0.2, 0.3, 0.5),
    (0.55, 0.68, 0.8), (0.8, 0.85, 0.9),
])  # fmt: skip

# Shapes of objects, and their frequencies.
_SHAPES, _SHARES = ("box", "ellipse", "pole", "bush"), (0.66, 0.08, 0.14, 0.12)


@cache
def photographs(width: int, height: int) -> Bank:
    """The process's bank of procedural photographs, and their mirror images, for images of that size [pixels]."""

    def make(which: int) -> np.ndarray:
        scene = photograph(which // 2, 2 * width, height)
        view = scene[:, ::-1] if which % 2 else scene
        return np.concatenate([view, view[:, :width]], axis=1)

    return Bank(2 * _SCENES, width, height, make)


@lru_cache(maxsize=2)
def photograph(number: int, width: int, height: int) -> np.ndarray:
    """A cluttered image, uint8 (height, width, 3), horizontally periodic; of a `number`, the same at every size."""
    plan, grain = np.random.default_rng((_SEED, number, 0)), np.random.default_rng((_SEED, number, 1))
    fine = 2 if height <= 128 else 1
    picture = _room(plan, grain, fine * height, fine * width)
    for extent, count in (((0.35, 0.8), 5), ((0.15, 0.4), 14), ((0.05, 0.18), 30)):
        for _ in range(count):
            _put_item(picture, np.random.default_rng(plan.integers(2**63)), grain, extent)
    size = picture.shape[:2]
    light = 1 + 0.22 * _noise(grain, size, 1.4)
    picture *= np.clip(light, 0.3, 1.7)[..., None]
    picture += 0.035 * _noise(grain, size, 1.0)[..., None]
    picture = gaussian_filter(picture, (0.45, 0.45, 0), mode=("nearest", "wrap", "nearest"))
    picture = picture.reshape(height, fine, width, fine, 3).mean((1, 3))
    return np.clip(255 * picture + 0.5, 0, 255).astype(np.uint8)


def _noise(grain: np.random.Generator, shape: tuple[int, ...], slope: float) -> np.ndarray:
    """Noise of `shape`, mean 0 and standard deviation 1, with amplitude spectrum 1 / frequency^slope."""
    height, width = shape
    fy, fx = np.fft.fftfreq(height) * height, np.fft.rfftfreq(width) * width
    radius = np.hypot(fy[:, None], fx * height / width)  # cycles per image height
    radius[0, 0] = np.inf
    noise = np.fft.irfft2(np.fft.rfft2(grain.standard_normal(shape)) / radius**slope, s=shape)
    return np.asarray(noise / noise.std())


def _colour(plan: np.random.Generator) -> np.ndarray:
    """A randomly varied colour (3,) of the palette."""
    return np.clip(_PALETTE[plan.integers(len(_PALETTE))] * plan.uniform(0.7, 1.15) + plan.normal(0, 0.03, 3), 0.02, 1)


def _room(plan: np.random.Generator, grain: np.random.Generator, height: int, width: int) -> np.ndarray:
    """Wall or sky above, floor or street below, both textured: (height, width, 3)."""
    picture = np.empty((height, width, 3))
    edge, depth = plan.uniform(0.5, 0.75), plan.uniform(4, 10)
    rows = (np.arange(height) + 0.5) / height
    wall = _colour(plan) * 0.5 + 0.35
    floor = _colour(plan) * 0.6 + 0.15
    upper = rows < edge
    picture[:] = wall * (1.1 - 0.3 * rows[:, None, None])
    below = (rows[~upper] - edge) / (1 - edge)
    picture[~upper] = floor * (0.75 + 0.4 * below[:, None, None])
    lines = np.floor(depth / (below + 0.25))[:, None]
    columns = np.arange(width) / width
    across = np.abs(columns * 24 % 1 - 0.5)[None]
    tiled = ((lines % 2) == (np.floor(columns * 16)[None] % 2)) if plan.random() < 0.6 else across < 0.06
    picture[~upper] *= 1 - plan.uniform(0.05, 0.35) * tiled[..., None]
    picture += plan.uniform(0.02, 0.06) * _noise(grain, (height, width), 0.9)[..., None]
    picture *= 1 + plan.uniform(0.03, 0.12) * _noise(grain, (height, width), 1.3)[..., None]
    return picture


def _put_item(picture: np.ndarray, plan: np.random.Generator, grain: np.random.Generator, size: tuple) -> None:
    """Draw an object on the wall or on the floor, with its shadow."""
    height, width = picture.shape[:2]
    shape = str(plan.choice(_SHAPES, p=_SHARES))
    high, x, lean = plan.uniform(*size), plan.uniform(0, width / height), plan.normal(0, 0.04)
    stands = shape in ("pole", "bush") or plan.random() < 0.5
    y = (plan.uniform(0.6, 1.1) if stands else plan.uniform(high, 0.9)) - high
    wide = min(high * np.exp(plan.normal(-0.3, 0.6)), 1.2)
    wide = {"pole": 0.06 * high + 0.01, "ellipse": min(wide, high)}.get(shape, wide)
    pad = 0.04 + abs(lean) * high
    rows = np.arange(max(int((y - pad) * height), 0), min(int((y + high + pad) * height) + 2, height))
    columns = np.arange(int((x - pad) * height), min(int((x + wide + pad) * height) + 2, int(x * height) + width - 2))
    if not len(rows) or not len(columns):
        return
    at = np.ix_(rows, columns % width)
    v = ((rows + 0.5) / height - y)[:, None] / high
    u = (((columns + 0.5) / height - x)[None] + lean * (v - 0.5) * high) / wide
    reach = 0.03 / max(wide, 0.03)
    shadow = _inside(shape, u - reach, v - 0.02, grain)
    soft = gaussian_filter(shadow.astype(float), 0.008 * height)
    window = picture[at] * (1 - plan.uniform(0.2, 0.6) * soft[..., None])
    inside = _inside(shape, u, v, grain)
    look = _texture(plan, grain, shape, u, v)
    window[inside] = look[inside]
    picture[at] = window


def _inside(shape: str, u: np.ndarray, v: np.ndarray, grain: np.random.Generator) -> np.ndarray:
    """Whether points, relative to an object's width and height, lie in it."""
    box = (u > 0) & (u < 1) & (v > 0) & (v < 1)
    if shape in ("box", "pole"):
        return box
    round_ = (u - 0.5) ** 2 + (v - 0.5) ** 2 < 0.25
    if shape == "ellipse":
        return round_
    return round_ & (_noise(grain, np.broadcast(u, v).shape, 1.0) > -0.35)


def _texture(plan: np.random.Generator, grain: np.random.Generator, shape: str, u, v) -> np.ndarray:
    """Colours (rows, columns, 3) of an object: shading, stripes, panes or grain, and a border."""
    u, v = np.broadcast_arrays(u, v)
    first, second = _colour(plan), _colour(plan)
    if shape == "bush":
        green = np.array((0.28, 0.38, 0.18)) * plan.uniform(0.6, 1.4)
        look = green * (1 + 0.45 * _noise(grain, u.shape, 0.7))[..., None]
    else:
        mix = _pattern(plan, u, v)
        look = first + (second - first) * (plan.uniform(0.25, 1.0) * mix)[..., None]
    shade = 1 + plan.uniform(-0.4, 0.4) * (u - 0.5) + plan.uniform(-0.3, 0.3) * (v - 0.5)
    if shape in ("pole", "ellipse"):
        shade = shade * (1 - 1.1 * (u - 0.45) ** 2)
    rough = 1 + plan.uniform(0.02, 0.14) * _noise(grain, u.shape, 0.9)
    look = look * (shade * rough)[..., None]
    return look


def _pattern(plan: np.random.Generator, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Weight (rows, columns) of the second colour: uniform, stripes, checks, or shelves with books."""
    kind, m, n = plan.integers(4), plan.integers(2, 9), plan.integers(2, 9)
    if kind == 0:
        return np.zeros(u.shape)
    if kind == 1:
        return (np.floor((u if plan.random() < 0.5 else v) * 2 * m) % 2).astype(float)
    if kind == 2:
        return ((np.floor(u * m) + np.floor(v * n)) % 2).astype(float)
    shelf = np.floor(v * n)
    book = np.floor(u * 9 * m / 2 + 3.7 * shelf)
    shade = (np.sin(book * 12.9898 + shelf * 78.233) * 43758.5453) % 1
    return np.where(v * n % 1 < 0.15 + 0.35 * ((shade * 7.7) % 1), 0.0, shade)


@cache
def sprites(width: int, height: int) -> np.ndarray:
    """Sprites for images of that size [pixels]: uint8 (sprites, rows, columns, 4), alpha in the last channel.

    First `PEOPLE` who walk to the right, `PHASES` of each; then `OBJECTS`. People fill a column half as wide as high.
    """
    size = max(width, height)
    shape = (size, max(size // 2, 8))
    things = [_thing(kind, i, *shape) for kind in OBJECTS for i in range(_EACH)]
    return np.ascontiguousarray(np.concatenate([_people(*shape), np.array(things)]))


def _people(rows: int, columns: int) -> np.ndarray:
    """Walking people from the side, (PEOPLE · PHASES, rows, columns, 4), rendered like the body itself."""
    plan, grain = np.random.default_rng((_SEED, 1000)), np.random.default_rng((_SEED, 1001))
    heights, girths = plan.uniform(1.55, 1.95, PEOPLE), plan.uniform(0.85, 1.3, PEOPLE)
    bodies = [from_height(h, girth=g) for h, g in zip(heights, girths, strict=True)]
    colours = outfits(plan.random((PEOPLE, len(WORN), 3)))
    which, phases = np.divmod(np.arange(PEOPLE * PHASES), PHASES)
    offsets, radii = np.array([b.offsets for b in bodies]), np.array([b.radii for b in bodies])
    slope = np.tan(np.radians(2))  # a distant camera, so that the height fills the rows
    f = rows / 2 / slope
    K = np.array([[f, 0, (columns - 1) / 2], [0, f, (rows - 1) / 2], [0, 0, 1]])
    R = look_at((0, -1, 0), (0, 0, 0)).R
    t = np.stack([0 * heights, heights / 2, 1.02 * heights / 2 / slope], -1)[which]
    K, R = np.tile(K, (len(which), 1, 1)), np.tile(R, (len(which), 1, 1))
    poses = _steps(2 * np.pi * phases / PHASES, heights[which])
    frame = MultiBodyRaycaster(columns, rows).render(
        poses, offsets[which], radii[which], heights[which], colours[which], K, R, t
    )
    assert frame.rgb is not None
    weave = 1 + 0.12 * np.array([_noise(grain, (rows, columns), 0.6) for _ in range(PEOPLE)])[which, ..., None]
    rgb = np.clip(frame.rgb * weave, 0, 255).astype(np.uint8)
    return np.concatenate([rgb, 255 * (frame.limbs > 0).astype(np.uint8)[..., None]], axis=-1)


def _steps(phase: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Poses (n, 25) of a simple walk to the right with sinusoidal legs and arms."""
    poses = np.zeros((len(phase), 25))
    poses[:, 2] = 0.525 * heights
    for hip, knee, shoulder, elbow, at in ((17, 20, 13, 16, phase), (21, 24, 9, 12, phase + np.pi)):
        poses[:, hip] = 0.1 + 0.42 * np.sin(at)
        poses[:, knee] = 0.12 + 0.8 * np.maximum(np.cos(at), 0) ** 2
        poses[:, shoulder], poses[:, elbow] = 0.4 * np.sin(at), 0.35 + 0.2 * np.sin(at)
    return poses


def _thing(kind: str, number: int, rows: int, columns: int) -> np.ndarray:
    """An object that fills (rows, columns, 4)."""
    index = list(OBJECTS).index(kind)
    plan, grain = (np.random.default_rng((_SEED, stream, index, number)) for stream in (2000, 2001))
    v, u = (np.arange(rows)[:, None] + 0.5) / rows, (np.arange(columns)[None] + 0.5) / columns
    shape = {"carts": "ellipse" if number % 2 else "box", "posts": "pole", "boxes": "box", "bushes": "bush"}[kind]
    inside = np.broadcast_to(_inside(shape, u, v, grain), (rows, columns))
    look = np.clip(255 * _texture(plan, grain, shape, u, v), 0, 255)
    return np.concatenate([look, 255.0 * inside[..., None]], axis=-1).astype(np.uint8)
