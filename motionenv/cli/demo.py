"""The `demo` command's output: a film of a walking person beside the point-light display."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from motionenv._core.precompilation import precompile
from motionenv.errors import MotionError
from motionenv.mocap import write
from motionenv.models.synthesis import synthesize
from motionenv.render import film
from motionenv.render.draw2d.overlay import side_by_side, strip
from motionenv.render.video.encode import write_image, write_video

SECONDS, FPS = 5, 30
_STRIP = 6


def make_demo(
    out: Path, *, seed: int | np.random.Generator = 1, on_frame: Callable[[int], None] = lambda done: None
) -> dict[Path, str]:
    """Write walk.mp4, strip.png and walk.bvh of a random person to the folder `out`; return each file's description.

    `on_frame` is called with the number of frames rendered so far.
    """
    out = Path(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MotionError(f"can't create the folder {out}: {error.strerror}; choose another with --out") from None
    precompile("demo")
    motion = synthesize("walk/fpca", SECONDS, FPS, seed=seed, speed=1.25)
    kept: list[np.ndarray] = []
    wanted = np.arange(_STRIP) * FPS // _STRIP  # of one second: a stride takes about as long

    def pictures() -> Iterator[np.ndarray]:
        bodies = film(motion, np.pi / 6, width=480, height=480)
        dots = film(motion, np.pi / 6, width=480, height=480, points=True)
        for i, (body, dot) in enumerate(zip(bodies, dots, strict=True)):
            if i in wanted:
                kept.append(body[:, 110:370])
            yield side_by_side(body, dot)

    write_video(out / "walk.mp4", pictures(), FPS, progress=on_frame)
    write_image(out / "strip.png", strip(kept, _STRIP))
    write(motion, out / "walk.bvh")
    return {
        out / "walk.mp4": "the walk beside its point-light display",
        out / "strip.png": f"{_STRIP} moments of a stride",
        out / "walk.bvh": "the motion, for Blender and other animation tools",
    }
