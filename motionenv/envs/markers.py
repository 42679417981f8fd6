"""motionenv/MarkerTracking-v1: 3D tracking from 15 noisy, incomplete 2D markers in an unknown view."""

from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_choice, checked_range, is_number
from motionenv.envs.base import SimulatedArguments, SimulatedTracking, taking
from motionenv.envs.simulation.marker_world import SENSES, MarkerWorld
from motionenv.envs.simulation.motion_sources import Source, episode_frames
from motionenv.envs.vector import SimulatedTrackingVector, VectorArguments
from motionenv.render.sensors.marker_sensor import MarkerSensor


@dataclass(frozen=True, kw_only=True)
class MarkerArguments(SimulatedArguments):
    """Arguments of `MarkerTracking`."""

    motion: str = "walk/eigenwalkers"
    split: str = "train"
    observation: str = "points"
    view: float | tuple[float, float] | None = None
    distance: float | None = None
    noise: float = 0.01
    dropout: float = 0.05
    gaps: float = 0.1
    gap_seconds: float = 0.3
    fps: float = 30.0
    horizon: int = 200
    speed: tuple[float, float] | None = None
    height: tuple[float, float] | None = None
    file_fps: float | None = None
    unit: str | None = None
    actions: str = "normalised"

    def __str__(self) -> str:
        return f"motion={self.motion!r}"

    def world(self, n: int) -> MarkerWorld:
        sense = checked_choice(self.observation, "observation", SENSES)
        frames, reading = episode_frames(self.horizon), (self.file_fps, self.unit)
        source = Source(self.motion, self.split, frames, self.fps, self.speed, self.height, *reading)
        sensor = MarkerSensor(self.noise, self.dropout, self.gaps, self.gap_seconds, self.distance, source.fps)
        return MarkerWorld(n, source, sensor, _radians(self.view), self.actions, sense == "joints")


@dataclass(frozen=True, kw_only=True)
class MarkerVectorArguments(MarkerArguments, VectorArguments):
    """Arguments of `MarkerTrackingVector`."""


def _radians(view) -> tuple[float, float]:
    if view is None:
        return -np.pi, np.pi
    if is_number(view):
        view = (view, view)
    low, high = checked_range(view, "view", -360, 360, "degrees")
    return float(np.radians(low)), float(np.radians(high))


class MarkerTracking(SimulatedTracking):
    """Tracking a walker in 3D from 2D markers in an unknown view.

    ## Description
    The setting of Zhang & Troje (2007, section 4.3) as a filtering problem. A static camera sees 15 markers of a person
    who walks in place, as on a treadmill, in an unknown direction. Each frame gives what a point tracker gives: noisy
    2D positions, some of them missing. The agent estimates the 3D positions of the markers.

    The world is fixed to the camera: x to the right in the image, y away from the camera, z up, the origin on the
    ground at the walker's mean position. A walker in the direction (cos α, -sin α) is seen at the paper's view angle α:
    0 is a side view, walking to the right; 90° is a front view. The image shows x and z. The depth y, relative to the
    walker's own position, must be inferred from the identity of left and right, joint limits and motion.

    Actions don't change what is seen. This is an estimation problem, for which a discount of γ = 0 is right.

    ## Action Space
    `Box(-1, 1, (15, 3), float32)`: estimated positions of the markers in the order of `motionenv.types.MARKERS`. An
    entry a stands for x or y = 2 m · a, or z = 1 m + 2 m · a. `action` converts positions [m] to an action, and
    `estimate` converts back. With `actions="metric"` the action is the positions themselves, within ±100 m.

    ## Observation Space
    `Dict`: "points", `Box(-100, 100, (15, 2), float32)`, horizontal and vertical position [m] of each marker, 0 if it
    is missing; "seen", `MultiBinary(15)`, whether it is visible. With `distance`, a point is where the ray from the
    camera intersects the plane y = 0, so that nearer markers are farther apart.

    With `observation="joints"`, which makes the task fully observable: `Box(-100, 100, (15, 3), float32)`, the true
    positions [m].

    ## Rewards
    Minus the mean distance [m] between estimated and true markers.

    ## Starting State
    Walker, phase, view angle and missing markers are random.

    ## Episode End
    Truncated after `horizon` estimates. Never terminated, so an agent that loses the track pays for every frame.

    ## Arguments
    - `motion="walk/eigenwalkers"`: 4,096 Fourier walkers per split, evaluated directly; or any other motion of
      `motionenv/WalkerTracking-v1`, with its straight path removed. `file_fps` and `unit` are for files that don't
      state them.
    - `split="train"`: or "eval", which has other walkers; with a folder, other people.
    - `observation="points"`: or "joints", see Observation Space.
    - `view=None`: view angle α [degrees], or a range (low, high); None is the full circle.
    - `distance=None`: distance of the camera [m], at least 2; None is orthographic, as in the paper.
    - `noise=0.01`: standard deviation [m] of each coordinate.
    - `dropout=0.05`: fraction of markers missing independently in each frame.
    - `gaps=0.1`, `gap_seconds=0.3`: fraction of the time that a marker is missing in longer gaps, and their mean
      duration.
    - `fps=30`, `horizon=200`: frame rate [Hz], and number of estimates in an episode.
    - `speed=None`, `height=None`: ranges (low, high) of walking speed [m/s] and body height [m]; None uses the motion's
      own.
    - `actions="normalised"`: or "metric", see Action Space.
    - `lost_after=None`: with a number, `info["lost"]` is true from the tenth consecutive estimate that is off by more
      than that many metres, until one is not.
    - `render_mode=None`: "rgb_array", the last estimated points with the estimate overlaid.

    `truth()` returns "joints" (15, 3) [m], "alpha" [rad], and "camera" (that of rendered images) for the last observed
    frame. Fourier walkers have neither pose nor skeleton. `observation_model` evaluates hypotheses (poses in this
    world) against that frame without access to the ground truth.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/MarkerTracking-v1", num_envs=1024)` steps all environments in compiled loops. It also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled").

    ## Version History
    - v1: actions are normalised, and losing the track doesn't end the episode.
    - v0: initial version.
    """

    @taking(MarkerArguments)
    def __init__(self, arguments: MarkerArguments) -> None:
        super().__init__(arguments)


class MarkerTrackingVector(SimulatedTrackingVector):
    """`num_envs` copies of `MarkerTracking` in an `autoreset_mode`, stepped together."""

    @taking(MarkerVectorArguments)
    def __init__(self, arguments: MarkerVectorArguments) -> None:
        super().__init__(arguments)
