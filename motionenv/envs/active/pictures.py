"""Pictures of ActiveTracking for people: the plaza from above, and what the camera sees."""

import colorsys

import numpy as np

from motionenv.body import EDGES
from motionenv.envs.active.scene_kernel import ASPECT, INNER, MAST, NARROW, OUTER, WIDE
from motionenv.render.cameras import look_at
from motionenv.render.draw2d.overlay import side_by_side
from motionenv.render.draw2d.shapes import draw_figures, draw_lines
from motionenv.types import Camera

#: Height of pictures [pixels].
SIDE = 360

_GROUND, _STONE, _LIGHT = (62, 66, 72), (150, 146, 138), (250, 244, 200)
_SCALE = SIDE / (2 * OUTER + 1)  # [pixels/m] of the map
_ROUND = np.linspace(0, 2 * np.pi, 41)


def camera_of(state: np.ndarray) -> Camera:
    """The camera in a `state` (6,): pan, tilt [rad], zoom, and their rates."""
    pan, tilt, zoom = state[:3]
    ahead = np.array([np.cos(pan) * np.cos(tilt), np.sin(pan) * np.cos(tilt), np.sin(tilt)])
    fov = 2 * np.degrees(np.arctan(ASPECT * WIDE * NARROW**zoom))
    eye = np.array([0.0, 0.0, MAST])
    return look_at(eye, eye + ahead, width=round(SIDE / ASPECT), height=SIDE, fov_degrees=float(fov))


def draw(
    state: np.ndarray, pillars: np.ndarray, walks: np.ndarray, joints: np.ndarray, hues: np.ndarray, points: np.ndarray,
    beliefs: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """The map and the camera's view side by side, uint8 (H, W, 3). True positions are dots, beliefs rings of 2 σ.

    Args:
        state: (6,) of the camera.
        pillars: (p, 3) [m] x, y and radius.
        walks: (people, 4) x, y [m], heading and phase.
        joints: (people, 15, 3) [m], true.
        hues: (people,) [rad].
        points: (k, 2) observed, in units of half the view's width.
        beliefs: (people, 3) x, y and standard deviation [m]; None draws none.
    """
    colours = 255 * np.array([colorsys.hsv_to_rgb(hue / (2 * np.pi) % 1, 0.75, 1.0) for hue in hues])
    return side_by_side(_map(state, pillars, walks, colours, beliefs), _view(state, pillars, joints, colours, points))


def _map(state, pillars, walks, colours, beliefs) -> np.ndarray:
    """The plaza from above: x up, y to the left."""
    image = np.full((SIDE, SIDE, 3), _GROUND, np.uint8)
    for radius in (INNER, OUTER):
        _line(image, radius * np.stack([np.cos(_ROUND), np.sin(_ROUND)], axis=-1), (90, 94, 100))
    across = np.arctan(WIDE * NARROW ** state[2])
    for way in (state[0] - across, state[0] + across):
        _line(image, np.array([[0, 0], [OUTER * np.cos(way), OUTER * np.sin(way)]]), _LIGHT)
    for x, y, radius in pillars:
        _line(image, np.array([[x, y], [x, y]]), _STONE, 2 * radius * _SCALE)
    for k, (x, y, heading, _) in enumerate(walks):
        _line(image, np.array([[x, y], [x + 0.9 * np.cos(heading), y + 0.9 * np.sin(heading)]]), colours[k])
        _line(image, np.array([[x, y], [x, y]]), colours[k], 8.0)
        if beliefs is not None:
            ring = np.stack([np.cos(_ROUND), np.sin(_ROUND)], axis=-1) * max(2 * beliefs[k, 2], 0.4)
            _line(image, beliefs[k, :2] + ring, colours[k])
    return image


def _view(state, pillars, joints, colours, points) -> np.ndarray:
    """What the camera sees, from far to near, and the observed `points` in white."""
    camera = camera_of(state)
    image = np.full((camera.height, camera.width, 3), _GROUND, np.uint8)
    distances = np.linalg.norm(np.concatenate([joints[:, 0, :2], pillars[:, :2]]), axis=-1)
    for i in np.argsort(-distances):
        if i < len(joints):
            pixels, depth = camera.project(joints[i])
            if depth.min() > 0.3:
                tint = np.tile(colours[i], (15, 1))
                draw_figures(image, pixels, depth, EDGES, tint, radius=3.0, width=3.0)
            continue
        x, y, radius = pillars[i - len(joints)]
        ahead = np.cos(state[0]) * x + np.sin(state[0]) * y
        if ahead > 0.3:
            ends, _ = camera.project(np.array([[x, y, 0.0], [x, y, MAST + 0.3 * ahead]]))
            wide = 2 * radius * camera.K[0, 0] * np.cos(state[1]) / ahead  # in the middle row
            draw_lines(image, ends.reshape(1, 4), float(wide), _STONE)
    spots = (np.array([camera.width - 1, camera.height - 1]) + points * camera.width) / 2
    draw_lines(image, np.tile(spots, 2), 3.0, (255.0, 255.0, 255.0))
    return image


def _line(image, path, colour, width=1.5) -> None:
    """Draw a `path` (n, 2) [m] on the map; of two equal points, a dot."""
    pixels = SIDE / 2 - _SCALE * path[:, ::-1]
    draw_lines(image, np.concatenate([pixels[:-1], pixels[1:]], axis=-1), width, tuple(map(float, colour)))
