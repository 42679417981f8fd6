"""motionenv/WalkerTracking-v1: the pose of a walking person in images."""

from functools import partial
from typing import Any

from motionenv.envs.base import SimulatedTracking
from motionenv.envs.pictures import picture_world
from motionenv.envs.simulation.motion_sources import Source
from motionenv.envs.simulation.picture_world import PictureWorld
from motionenv.envs.simulation.views import WalkingView
from motionenv.envs.vector import SimulatedTrackingVector


def walker_world(
    n: int, *, motion: str = "walk/fpca", start: str = "near", path: str = "straight", **arguments: Any
) -> PictureWorld:
    """`n` walkers, each in front of their own camera; `motion`, `start` and `path` are as in `WalkerTracking`.

    The other `arguments`, and errors, are those of `picture_world`.
    """

    def direct(source: Source, camera: str | float) -> tuple[Source, WalkingView]:
        return source, WalkingView(camera, source.fps, (source.frames - 1) / source.fps, start, path)

    return picture_world(n, direct, motion=motion, scored={}, **arguments)


class WalkerTracking(SimulatedTracking):
    """Tracking the pose of a walking person in images.

    ## Description
    A person walks; each step shows the next image, and the agent estimates the person's pose. Body, clothes and gait
    differ between episodes, and where people walk and whereto; view, scenery, noise and light too, if enabled.

    Positions are in metres: z up, the ground at z = 0; seen from the side, x goes to the right of the image, y away
    from the camera. A static camera is 1.1 m high and level, 3.5 m and another 1.5 m per second of an episode away from
    the origin, at which it is aimed, and shows the walker's whole path. A following camera moves beside the walker, and
    the origin with it: it is the ground point at which the camera is aimed. The walker's absolute position, which no
    image shows, is then not part of the task.

    Actions never change what is seen: this is an estimation problem, for which a discount of γ = 0 is right.

    ## Action Space
    An estimate for the last observed frame, in the form given by `estimate`:

    - "pose": `Box(-1, 1, (25,), float32)`, the pose vector of `motionenv.types.POSE`. It is applied to the true body,
      so body size is not part of the task.
    - "joints": `Box(-1, 1, (15, 3), float32)`, positions in the order of `motionenv.types.MARKERS`.
    - "belief": `Box(-1, 1, (n_belief, 26), float32)`, poses, each followed by its log weight up to a constant.

    An entry a says x or y = reach · a, z = 1 m + 2 m · a, an angle of π · a, or a log weight of 10 · a. The reach is 2
    m, with a static camera another 1.5 m per second of an episode, and what `start` adds: 8.5 m by default. `action`
    turns an estimate [m, rad] into an action, `estimate` back. With `actions="metric"` the action is the estimate
    itself: positions within ±100 m, angles within ±4π, log weights within ±100.

    ## Observation Space
    In the form given by `observation`: "rgb" `Box(0, 255, (size, size, 3), uint8)`; "mask" `Box(0, 255, (size, size,
    1), uint8)`, 255 where the body is visible; "depth" `Box(0, 20, (size, size, 1), float32)` [m] along the camera's
    axis, 20 where nothing is nearer. A sequence of these gives a `Dict` of them.

    ## Rewards
    Minus the mean distance [m] between the estimated and true positions of the 15 joints; for a belief, minus its
    energy score over all joints (`motionenv.metrics.energy_score`), a proper score, divided by √15, which makes it
    comparable with a distance per joint. `info["error"]` is the mean distance; for a belief, that of its mean.

    ## Starting State
    Walker, phase, body height, place, direction, colours, view and scenery are random.

    ## Episode End
    Truncated after `horizon` estimates; never terminated, so that losing the track saves nobody its cost.

    ## Arguments
    - `motion="walk/fpca"`: source of motion: a model ("walk/fpca", "walk/eigenwalkers", "mixed/tree", or a model file),
      a motion file, or a folder of capture files (.amc, .bvh, .c3d, .trc, .npz). `file_fps` and `unit` are for files
      that don't specify them.
    - `motion_seed=None`: with a number, every episode shows the motion of `motionenv.synthesize(motion, (horizon + 1) /
      fps, fps, seed=motion_seed)` from its first frame, in both splits: the same walk as from the service, the web page
      and `motionenv synth` with that seed, turned and placed by `start`. `speed` and `height` must then be one number,
      given twice.
    - `split="train"`: or "eval", which has other walkers; of a folder, other people, about one in four, selected by a
      hash of their label. A single file is one person, the same in both.
    - `size=64`: image side, 36 to 256 pixels.
    - `observation="rgb"`: "rgb", "mask", "depth", or several of them.
    - `start="near"`: people walk either way within 30° of the x axis, up to 2 m farther from the camera than needed to
      show their whole path, and anywhere across the image. "anywhere": in all directions, up to 4 m farther. "line":
      along x through the origin, in the middle of the image, with the camera as near as the whole path allows. With
      `camera="follow"` only directions differ.
    - `path="straight"`: or "turning", a random path of curves of at least 1.5 m radius, with `motionenv.models.paths`.
    - `camera="side"`: "side", "front", a view angle in degrees, "random" (any view angle, which only the camera of
      `observation_model` reveals), or "follow" (moves along). A static camera shows the whole path, so a walker appears
      small if `horizon` is more than some seconds, and "depth" doesn't show a body beyond 20 m; use "follow" then.
    - `background="plain"`: or "clutter"; `distractors=0`: passing people and objects; `occluders=0`: occluding objects;
      `noise=0`: standard deviation in grey levels of 255; `brightness=0`: relative variation of the light. Noise and
      light affect "rgb" only; "mask" and "depth" are exact.
    - `fps=30`, `horizon=90`: frame rate, and number of estimates in an episode.
    - `speed=None`, `height=None`: (low, high) of walking speed [m/s] and body height [m]; None uses the model's own
      speeds and heights of 1.5 to 1.95 m, or the captured people's own.
    - `clothes=True`: colours differ between episodes.
    - `estimate="pose"`, `n_belief=64`, `actions="normalised"`: see Action Space.
    - `lost_after=None`: with a number, `info["lost"]` is true once ten consecutive estimates or more were off by more
      than that many metres, until one is not. It changes neither rewards nor the episode's length.
    - `render_mode=None`: "rgb_array", the last estimated frame with the estimate overlaid, at least 256 pixels wide; or
      "human", the same in a window.

    `truth()` returns "pose" (25,), "joints" (15, 3), "camera" and "skeleton" for the last observed frame.
    `observation_model` evaluates hypotheses against that frame without access to the ground truth. If only "rgb" is
    observed, it learns the background from the frames in which it is accessed: access it in each frame.

    ## Vectorized environment
    `gymnasium.make_vec("motionenv/WalkerTracking-v1", num_envs=64)` renders all images of a step in one batch; it also
    accepts `autoreset_mode` ("NextStep", "SameStep", "Disabled") and `threads`.

    ## Version History
    - v1: people walk anywhere, actions are normalised, and losing the track ends nothing.
    - v0: initial version.
    """

    make_world = staticmethod(walker_world)


class WalkerTrackingVector(SimulatedTrackingVector):
    """`num_envs` copies of `WalkerTracking`, rendered in batches by `threads` threads, None is one per core.

    The other arguments are those of `SimulatedTrackingVector` and of `WalkerTracking`.
    """

    make_world = staticmethod(partial(walker_world, threads=None))
