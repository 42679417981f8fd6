"""motionenv/MarkerTracking-v0: 15 markers in 2D, noisy and with gaps, from an unknown view; the estimate is 3D."""

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from motionenv.envs.base import TrackingEnv
from motionenv.envs.marker_world import MarkerWorld
from motionenv.envs.sources import Source
from motionenv.envs.vector import TrackingVectorEnv
from motionenv.errors import MotionError
from motionenv.estimation import MarkerModel
from motionenv.render.marker_sensor import MarkerSensor


class MarkerTracking(TrackingEnv):
    """Tracking a walker in 3D from its markers in 2D, the view unknown.

    ## Description
    The setting of Zhang & Troje (2006, section 4.3) as a filter: 15 markers of somebody who walks in place, as on a
    treadmill, are seen by a camera that stands still, while the direction of walking is unknown. Each frame gives what
    a tracker of points gives: 2D positions with noise, some missing. The agent says where the markers are in 3D.

    The world is fixed to the camera: x to the right in the picture, y away from the camera, z up, the origin on the
    ground where the walker is on average. Walking along direction (cos α, -sin α), the walker shows the paper's view
    angle α: 0 from the side, walking to the right; 90° from the front. So x and z are seen, and what has to be inferred
    is y: depth about the walker's own place, which left and right, the bends of the joints and their motion tell.

    ## Action Space
    `Box(-100, 100, (15, 3), float32)`: the estimated positions [m] of the markers in the order of
    `motionenv.types.MARKERS`.

    ## Observation Space
    `Dict`: "points", `Box(-100, 100, (15, 2), float32)`, how far to the right and how high [m] each marker is seen,
    0 if it isn't; "seen", `MultiBinary(15)`, whether it is. With `distance`, points are where the ray from the camera
    meets the plane y = 0, so that nearer markers are farther apart.

    ## Rewards
    Minus the mean distance [m] between estimated and true markers.

    ## Starting State
    Walker, phase, view angle, and what is missing are drawn at random.

    ## Episode End
    Truncated after `horizon` estimates; terminated, if `lost_after` is given, when that many metres of error are
    exceeded ten times on end.

    ## Arguments
    See below. `truth()` holds "joints" (15, 3) [m], "alpha" [rad], and "camera", the one of `render`'s pictures.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/MarkerTracking-v0", num_envs=1024)` steps all in compiled loops, in any
    `autoreset_mode`.

    ## Version History
    v0: initial version.

    Args:
        motion: "walk/eigenwalkers", whose Fourier walkers are evaluated as they are, 4,096 of them per split; or any
            other that `motionenv/WalkerTracking-v0` takes, less its way along a straight line.
        view: view angle α [degrees], or the least and the greatest; None is the full circle.
        distance: of the camera [m], from 2 on; None is orthographic, as in the paper.
        noise: standard deviation [m] of each coordinate.
        dropout: share of markers that are missing, by chance in each frame.
        gaps: share of the time for which a marker is missing in one piece.
        gap_seconds: mean duration of that [s].
        height: least and greatest body height [m]; None leaves it to the motion.
        speed: least and greatest walking speed [m/s]; None leaves it to the model.
        fps: frames per second.
        horizon: estimates in an episode.
        split: "train" or "eval": other walkers, or other people.
        lost_after: error [m] beyond which the track counts as lost; None for never.
        render_mode: None, "rgb_array" or "human".
    """

    def __init__(
        self,
        *,
        motion: str = "walk/eigenwalkers",
        view: float | tuple[float, float] | None = None,
        distance: float | None = None,
        noise: float = 0.01,
        dropout: float = 0.05,
        gaps: float = 0.1,
        gap_seconds: float = 0.3,
        height: tuple[float, float] | None = None,
        speed: tuple[float, float] | None = None,
        fps: float = 30.0,
        horizon: int = 200,
        split: str = "train",
        lost_after: float | None = None,
        render_mode: str | None = None,
    ):
        source = Source(motion, split, _frames(horizon), fps, speed, height)
        sensor = MarkerSensor(noise, dropout, gaps, gap_seconds, distance, source.fps)
        self.world: MarkerWorld
        super().__init__(MarkerWorld(1, source, sensor, _degrees(view)), render_mode=render_mode, lost_after=lost_after)

    @property
    def observation_model(self) -> MarkerModel:
        """The likelihood of the current observation, given poses (N, 25) in this world; it doesn't see the truth.

        Raises:
            ResetNeeded: before the first `reset`.
        """
        if self._np_random is None:
            raise ResetNeeded("there is no observation yet: call reset() first")
        return self.world.observation_model(0)


class MarkerTrackingVector(TrackingVectorEnv):
    """`num_envs` times `MarkerTracking`, stepped together.

    Args:
        num_envs: how many.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED.
        render_mode: None or "rgb_array".
        lost_after: see `MarkerTracking`.
        motion, view, distance, noise, dropout, gaps, gap_seconds, height, speed, fps, horizon, split: see there.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        motion: str = "walk/eigenwalkers",
        view: float | tuple[float, float] | None = None,
        distance: float | None = None,
        noise: float = 0.01,
        dropout: float = 0.05,
        gaps: float = 0.1,
        gap_seconds: float = 0.3,
        height: tuple[float, float] | None = None,
        speed: tuple[float, float] | None = None,
        fps: float = 30.0,
        horizon: int = 200,
        split: str = "train",
        lost_after: float | None = None,
        render_mode: str | None = None,
    ):
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise MotionError(f"num_envs must be a whole number from 1, got {num_envs!r}")
        source = Source(motion, split, _frames(horizon), fps, speed, height)
        sensor = MarkerSensor(noise, dropout, gaps, gap_seconds, distance, source.fps)
        super().__init__(
            MarkerWorld(num_envs, source, sensor, _degrees(view)),
            render_mode=render_mode,
            lost_after=lost_after,
            autoreset_mode=autoreset_mode,
        )


def _frames(horizon) -> int:
    """Frames of an episode.

    Raises:
        MotionError: `horizon` isn't a whole number above 0.
    """
    if isinstance(horizon, bool) or not isinstance(horizon, int) or not 1 <= horizon <= 100_000:
        raise MotionError(f"horizon must be a whole number of estimates from 1 to 100000, got {horizon!r}")
    return horizon + 1


def _degrees(view) -> tuple[float, float]:
    """Least and greatest view angle [rad].

    Raises:
        MotionError: not an angle or two in order, within ±360 degrees.
    """
    if view is None:
        return -np.pi, np.pi
    try:
        low, high = (float(view), float(view)) if isinstance(view, int | float) else map(float, view)
    except (TypeError, ValueError):
        low = high = np.nan
    if not -360 <= low <= high <= 360:
        raise MotionError(f"view must be an angle in degrees, or the least and the greatest, got {view!r}")
    return float(np.radians(low)), float(np.radians(high))
