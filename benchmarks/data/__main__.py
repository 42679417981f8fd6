"""Speed of making data sets, each figure beside its peer or baseline in the same run.

    motionenv bench data

- "renderer" draws the same people with the same cameras and scenery, all of them ready: `MultiBodyRaycaster` and
  `Augmenter`. What a generator needs more is motion, cameras, truth and passing on.
- "encoders" encodes the same pictures, ids and depths, drawn before, and writes them.
- pyrender draws the same walkers at 640 x 480 in a loop (colour and depth, then ids), without any annotation.
- The small network is a convolution with pooling and a linear layer, one step for each 32 pictures.
"""

import io
import json
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks import Arguments, has, shortest
from motionenv.data import Sampler, Specification, Walkers, generate
from motionenv.data.formats.webdataset import WebDataset
from motionenv.data.samples.drawing import Drawing
from motionenv.data.samples.groups import Group
from motionenv.types import Camera, Skeleton

FIELDS = ("rgb", "mask", "limbs", "people", "depth", "poses", "joints", "pixels", "visibility", "phase", "contact",
          "body", "camera")  # fmt: skip
CLIPS = Specification.read("tracking").replace(
    frames=10**6, people={"passers_by": [0, 0]}, output={"fields": FIELDS}, pictures={"objects": 0, "occluders": 0}
)


def consumed(spec: Specification, start: int, stop: int) -> None:
    """Draw samples and forget them."""
    for _ in Sampler(spec).samples(start, stop):
        pass


def of_size(size: int, spec: Specification = CLIPS, **changes) -> Specification:
    """A specification with square pictures."""
    return spec.replace(pictures={"width": size, "height": size}, **changes)


def against_renderer(quick: bool) -> None:
    """Raw arrays of a worker, against the renderer alone."""
    print("\n| raw arrays, one worker | frames/s | renderer alone | ratio (goal 0.7) |\n|-|-|-|-|")
    for size in (64,) if quick else (64, 256):
        for what, spec in (
            ("clips of 60", of_size(size, **({"clip": 2} if quick else {}))),
            ("single pictures, 16 views of a walker", of_size(size, clip=1, people={"views": 16})),
            ("single pictures, 64 views of a walker", of_size(size, clip=1, people={"views": 64})),
        ):
            count = Sampler(spec).per_group
            consumed(spec, 0, count)
            ours = shortest(lambda spec=spec, count=count: consumed(spec, 0, count))
            group, drawing, whole = Group(spec, 0), Drawing(spec, rgb=True), np.arange(count)
            at_once = max(1, (1 << 22) // (spec.clip * size * size))

            def draw(group=group, drawing=drawing, whole=whole, at_once=at_once) -> None:
                for first in range(0, len(whole), at_once):
                    drawing.draw(group, whole[first : first + at_once])

            alone = shortest(draw)
            frames = count * spec.clip
            print(f"| {size}², {what} | {frames / ours:,.0f} | {frames / alone:,.0f} | {alone / ours:.2f} |")


def against_encoders(quick: bool) -> None:
    """Lossless shards of a worker, against the encoders alone."""
    print("\n| lossless pictures, ids and depth | frames/s | encoders alone | ratio (goal 0.8) |\n|-|-|-|-|")
    for size in (64,) if quick else (64, 256):
        spec = of_size(size, **({"clip": 2} if quick else {}))
        samples = list(Sampler(spec).samples(0, 8))

        def written(made, spec=spec) -> None:
            folder = Path(tempfile.mkdtemp())
            try:
                WebDataset().write(iter(made()), folder, 0, spec)
            finally:
                shutil.rmtree(folder)

        whole = shortest(lambda spec=spec, written=written: written(lambda: Sampler(spec).samples(0, 8)))
        alone = shortest(lambda samples=samples, written=written: written(lambda: samples))
        print(f"| {size}² | {8 * spec.clip / whole:,.0f} | {8 * spec.clip / alone:,.0f} | {alone / whole:.2f} |")


def rate_of(spec: Specification, **how) -> float:
    """Frames per second of a whole set, once the workers have started: without the first shard of each."""
    folder, times = tempfile.mkdtemp(), []
    try:
        generate(spec, folder, on_shard=lambda row: times.append((time.perf_counter(), row["frames"])), **how)
    finally:
        shutil.rmtree(folder)
    skipped = min(4, len(times) - 1)
    return sum(frames for _, frames in times[skipped:]) / (times[-1][0] - times[skipped - 1][0])


def of_workers(quick: bool) -> None:
    """Two workers against one."""
    clip, shards = (2, 3) if quick else (60, 48)
    spec = of_size(128, clip=clip, frames=2 * clip * shards, output={"fields": FIELDS, "shard": 2 * clip})
    one, two = rate_of(spec, workers=1), rate_of(spec, workers=2)
    print("\n| | frames/s | ratio | goal |\n|-|-|-|-|")
    print(f"| one worker, 128² lossless | {one:,.0f} | | |")
    print(f"| two workers | {two:,.0f} | {two / one:.2f} of one | 1.8 |")


def against_pyrender(quick: bool) -> None:
    """COCO keypoints at 640 × 480, against a loop with pyrender."""
    from motionenv.render.opengl.engine import PyrenderRenderer

    half = 4 if quick else 256
    spec = Specification.read("keypoints").replace(frames=2 * half, output={"shard": 2 * half})
    sampler, folder = Sampler(spec), Path(tempfile.mkdtemp())
    from motionenv.data.formats.coco import Coco

    Coco().write(sampler.samples(0, half), folder / "first", 0, spec)  # photographs are made once in a process
    began = time.perf_counter()
    Coco().write(sampler.samples(half, 2 * half), folder / "second", 1, spec)
    ours = (time.perf_counter() - began) / half
    shutil.rmtree(folder)
    group, renderer = Group(spec, 0), PyrenderRenderer()
    views, look = group.views, spec.pictures

    def loop(count: int) -> None:
        for i in range(count):
            body = Skeleton(group.offsets[i], group.radii[i], float(group.heights[i]))
            camera = Camera(views.K[i], views.R[i], views.t[i, 0], look.width, look.height)
            renderer.render(group.poses[i, 0], body, camera)

    count = 2 if quick else 24
    loop(2)
    theirs = shortest(lambda: loop(count), 1) / count
    print("\n| COCO keypoints, 640 × 480, per frame | ms | ratio (goal 50) |\n|-|-|-|")
    print(f"| motionenv: scenery, passers-by, JPEG, annotations | {1000 * ours:.1f} | |")
    print(f"| pyrender in a loop: one body, no annotation | {1000 * theirs:.1f} | {theirs / ours:.0f} |")
    print(f"| BlenderProc, as published | 600 | {0.6 / ours:.0f} |")


def network_step() -> Callable[[np.ndarray, np.ndarray], None]:
    """A step of training with pictures (n, 64, 64, 3) and joints (n, 15, 3)."""
    import torch

    torch.set_num_threads(1)
    layers = torch.nn
    network = layers.Sequential(
        layers.Conv2d(3, 8, 5, 4), layers.ReLU(), layers.AvgPool2d(3), layers.Flatten(), layers.Linear(200, 45)
    )
    optimiser = torch.optim.SGD(network.parameters(), 1e-6)

    def step(rgb: np.ndarray, joints: np.ndarray) -> None:
        seen = torch.from_numpy(rgb).permute(0, 3, 1, 2).float() / 255
        loss = (network(seen) - torch.from_numpy(joints).float().reshape(len(rgb), -1)).square().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()

    return step


def decoded(sample: dict) -> tuple[np.ndarray, ...]:
    """Pictures, ids, depth and joints of a sample as WebDataset reads it."""
    rgb, limbs = (np.asarray(Image.open(io.BytesIO(sample[f"{name}.png"]))) for name in ("rgb", "limbs"))
    depth = np.load(io.BytesIO(sample["depth.npz"]))["depth"]
    return rgb, limbs, depth, np.array(json.loads(sample["truth.json"])["joints"])


def against_files(quick: bool) -> None:
    """A small network fed on the fly, against the same from WebDataset's files."""
    if not has("torch", "webdataset"):
        return
    import webdataset

    frames = 64 if quick else 4096
    fields = ("rgb", "limbs", "depth", "joints")
    spec = of_size(64, clip=1, frames=frames, people={"views": 16}, output={"fields": fields})
    folder, step = Path(tempfile.mkdtemp()), network_step()
    generate(spec, folder, workers=2)

    def on_the_fly() -> None:
        for batch in Walkers(spec).stream(batch=32):
            step(batch["rgb"], batch["joints"])

    def from_files() -> None:
        tars = sorted(str(path) for path in folder.glob("shards/*.tar"))
        for rgb, _, _, joints in webdataset.WebDataset(tars, shardshuffle=False).map(decoded).batched(32):
            step(np.stack(rgb), np.stack(joints))

    on_the_fly()
    fly, files = shortest(on_the_fly, 2), shortest(from_files, 2)
    shutil.rmtree(folder)
    print("\n| feeding a small network, 64² RGB, ids, depth, one process | pictures/s | ratio (goal 2) |\n|-|-|-|")
    print(f"| Walkers, on the fly | {frames / fly:,.0f} | {files / fly:.1f} |")
    print(f"| the same from WebDataset's files | {frames / files:,.0f} | |")


def main() -> None:
    """Print all tables."""
    quick = Arguments(__doc__).parse_args().quick
    for part in (against_renderer, against_encoders, of_workers, against_pyrender, against_files):
        part(quick)


if __name__ == "__main__":
    main()
