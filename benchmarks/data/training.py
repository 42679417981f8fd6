"""Are the data good? A small network learns to lift from generated clips alone, and is tested on captured people.

    motionenv bench data.training [--mocap FOLDER] [--minutes 12] [--bodies average]

A temporal convolution with 0.9 M parameters sees the `detected` points of the preset `lifting`, drawn while it learns,
on one core, and tells the joints relative to the pelvis in the camera's frame. It is tested on captured clips before
cameras, with a detector's errors (`motionenv.mocap.keypoints.DetectorErrors`): Bandai-Namco's walks and turns, of which
nothing here has learned, and CMU's walks, to which the model that makes the training data was fitted. Size of network,
rate of learning and stretches of time were set once, before any test; no test was used to change them. The last column
is the error on generated people left out (indices that aren't trained on).

With `--bodies average` the same people walk with one body of average proportions at their heights, as one learns from a
mannequin: does it help that bodies differ?
"""

import time
from pathlib import Path

import numpy as np

from benchmarks import Arguments, needs, scratch

needs("torch")
import torch
from torch import nn

from benchmarks.free_walking import bandai
from motionenv.body import markers
from motionenv.data import Specification, Walkers
from motionenv.metrics.points import aligned_mpjpe, pelvis_mpjpe
from motionenv.mocap import read, to_markers
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.models import gait_model
from motionenv.types import MARKERS, Camera, Markers, Points

FRAMES, WIDTH, BATCH, RATE = 60, 192, 64, 1e-3
PELVIS = MARKERS.index("pelvis")
AVERAGE = gait_model("walk/fpca")
FIELDS = ("detected", "joints", "camera")
BODIES = ("own", "average")
TOLD = (1.0, 2.0, 4.0, 8.0, 12.0)  # minutes
_LEFT_OUT = 10_000  # clips at the end of the set that aren't trained on


class Lifter(nn.Module):
    """Residual convolutions over time: features (n, frames, c) to joints (n, frames, 15, 3) [m]."""

    def __init__(self):
        super().__init__()
        self.first = nn.Conv1d(15 * 4 + 3, WIDTH, 1)
        self.blocks = nn.ModuleList(
            nn.Sequential(nn.Conv1d(WIDTH, WIDTH, 5, padding=2 * d, dilation=d), nn.GELU(), nn.Conv1d(WIDTH, WIDTH, 1))
            for d in (1, 2, 4, 8)
        )
        self.last = nn.Conv1d(WIDTH, 45, 1)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """The joints of features."""
        x = self.first(features.transpose(1, 2))
        for block in self.blocks:
            x = x + block(x)
        return self.last(nn.functional.gelu(x)).transpose(1, 2).reshape(*features.shape[:2], 15, 3)


def features(detected: np.ndarray, K: np.ndarray) -> torch.Tensor:
    """Features (n, frames, 63) of points with confidence (n, frames, 15, 3) seen by cameras with K (n, 3, 3)."""
    focal, centre = K[:, 0, 0][:, None, None, None], K[:, :2, 2][:, None, None]
    rays = (detected[..., :2] - centre) / focal
    middle = np.nanmean(rays, axis=(1, 2), keepdims=True)
    size = np.sqrt(np.nanmean((rays - np.nanmean(rays, axis=2, keepdims=True)) ** 2, axis=(1, 2, 3), keepdims=True))
    flat = (rays - middle) / size
    seen = np.isfinite(flat[..., :1])
    points = np.concatenate([np.where(seen, flat, 0), seen, np.where(seen, detected[..., 2:], 0)], axis=-1)
    whole = np.concatenate([middle, np.log(size)], axis=-1)[:, :, 0]
    together = np.concatenate([points.reshape(*points.shape[:2], -1), np.repeat(whole, points.shape[1], 1)], axis=-1)
    return torch.from_numpy(together.astype(np.float32))


def relative(joints: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Joints (n, frames, 15, 3) in the camera's frame, relative to the pelvis."""
    return (joints - joints[:, :, PELVIS : PELVIS + 1]) @ R.transpose(0, 2, 1)[:, None]


def lifted(network: Lifter, points: Points, camera: Camera) -> np.ndarray:
    """Joints (frames, 15, 3) [m] relative to the pelvis in the camera's frame: the mean of overlapping windows."""
    seen = np.concatenate([points.positions, points.confidence[..., None]], axis=-1)
    frames = len(seen)
    seen = np.concatenate([seen, np.repeat(seen[-1:], max(0, FRAMES - frames), axis=0)])
    starts = sorted({*range(0, len(seen) - FRAMES + 1, FRAMES // 4), len(seen) - FRAMES})
    windows = np.stack([seen[start : start + FRAMES] for start in starts])
    with torch.no_grad():
        found = network(features(windows, np.repeat(camera.K[None], len(windows), 0))).numpy()
    total, count = np.zeros((len(seen), 15, 3)), np.zeros((len(seen), 1, 1))
    for start, part in zip(starts, found, strict=True):
        total[start : start + FRAMES] += part
        count[start : start + FRAMES] += 1
    return (total / count)[:frames]


def cmu_walks(mocap: Path, count: int) -> list[Markers]:
    """Some of CMU's captured walks at 30 Hz."""
    paths = sorted((mocap / "cmu_asfamc").rglob("*.amc"))
    chosen = [paths[i] for i in sorted(np.random.default_rng(1).permutation(len(paths))[:count])]
    walks = []
    for path in chosen:
        positions = to_markers(read(path, fps=120)).positions[::4]
        walks.append(Markers(MARKERS, positions - positions[:, PELVIS].mean(0) * [1, 1, 0], 30.0, name=path.stem))
    return walks


def tests(mocap: Path, clips: int) -> dict[str, list[tuple[Points, Camera]]]:
    """Captured clips as a detector sees them, by kind; three cameras each."""
    kinds = {f"Bandai-Namco, {kind}": bandai.clips(mocap, kind, clips) for kind in ("forward walks", "turns")}
    kinds["CMU's walks"] = cmu_walks(mocap, clips)
    made: dict[str, list[tuple[Points, Camera]]] = {}
    for kind, motions in kinds.items():
        rng = np.random.default_rng(5)
        made[kind] = [
            (DetectorErrors().apply(bandai.seen(markers, camera), rng), camera)
            for markers in motions
            for camera in bandai.cameras(markers, rng)
        ]
    return made


def judged(network: Lifter, sequences: list[tuple[Points, Camera]]) -> tuple[float, float]:
    """Mean error per joint [mm], pelvis at the pelvis and aligned by similarity."""
    errors = []
    for points, camera in sequences:
        truth = points.truth.positions @ camera.R.T
        found = lifted(network, points, camera)
        errors.append((np.nanmean(pelvis_mpjpe(found, truth)), np.nanmean(aligned_mpjpe(found, truth))))
    return tuple(1000 * np.mean(errors, axis=0))


def generated(spec: Specification, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Features and truth of generated people who aren't trained on."""
    walkers = Walkers(spec)
    first = len(walkers) - _LEFT_OUT
    samples = list(walkers.sampler.samples(first, first + count))
    stacked = {name: np.stack([sample[name] for sample in samples]) for name in samples[0]}
    return [(features(stacked["detected"], stacked["K"]), relative(stacked["joints"], stacked["R"]))]


def as_mannequins(batch: dict[str, np.ndarray], spec: Specification, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The clips of a `batch` with average bodies of the same heights, before the same cameras."""
    joints = np.stack([markers(p, AVERAGE.body(h)) for p, h in zip(batch["poses"], batch["height"], strict=True)])
    seen = joints @ batch["R"].transpose(0, 2, 1)[:, None] + batch["t"][:, :, None]
    flat = seen[..., :2] / seen[..., 2:] * batch["K"][:, None, None, :1, 0] + batch["K"][:, None, None, :2, 2]
    found = [DetectorErrors().apply(Points(pixels, spec.fps, "px"), rng) for pixels in flat]
    detected = np.stack([np.concatenate([p.positions, p.confidence[..., None]], axis=-1) for p in found])
    return {**batch, "joints": joints, "detected": detected}


def train(spec: Specification, minutes: float, bodies: str, told) -> None:
    """Train on `bodies` for some `minutes`; at each of `TOLD` it calls `told(minutes, network, clips)`."""
    torch.manual_seed(0)
    torch.set_num_threads(1)
    network = Lifter()
    print(f"{sum(p.numel() for p in network.parameters()) / 1e6:.2f} M parameters", flush=True)
    optimiser = torch.optim.AdamW(network.parameters(), RATE)
    stages = [stage for stage in TOLD if stage < minutes] + [minutes]
    if bodies == "average":
        spec = spec.replace(output={"fields": (*FIELDS, "poses", "body")})
    spent, clips, began, rng = 0.0, 0, time.perf_counter(), np.random.default_rng(6)
    for drawn in Walkers(spec).stream(batch=BATCH):
        batch = drawn if bodies == "own" else as_mannequins(drawn, spec, rng)
        for group in optimiser.param_groups:
            group["lr"] = RATE * 0.5 * (1 + np.cos(np.pi * min(spent / (60 * minutes), 1)))
        off = network(features(batch["detected"], batch["K"])) - torch.from_numpy(
            relative(batch["joints"], batch["R"]).astype(np.float32)
        )
        loss = off.norm(dim=-1).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        spent, clips = spent + time.perf_counter() - began, clips + BATCH
        if spent >= 60 * stages[0]:
            told(stages.pop(0), network, clips)
        began = time.perf_counter()
        if not stages:
            return


def draw(rows: list[tuple], kinds: list[str], path: Path) -> None:
    """Draw the learning curve."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plot

    figure, axes = plot.subplots(figsize=(6, 4), layout="constrained")
    for k, kind in enumerate([*kinds, "generated, left out"]):
        axes.plot([row[0] for row in rows], [row[2][k] for row in rows], "o-", label=kind)
    axes.set(xlabel="minutes of training on one core", ylabel="error per joint, pelvis-aligned [mm]", xscale="log")
    axes.set_ylim(bottom=0)
    axes.legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Train, test at several times, print the table and draw the curve."""
    parser = Arguments(__doc__, mocap=("bandai_namco", "cmu_asfamc"))
    parser.add_argument("--minutes", type=float, default=TOLD[-1], quick=0.001)
    parser.add_argument("--bodies", choices=BODIES, default=BODIES[0], help="whose proportions are learned from")
    plot = Path(__file__).with_name("learning.png")
    parser.add_argument("--plot", type=Path, default=plot, quick=scratch() / plot.name, help="file for the curve")
    options = parser.parse_args()
    spec = Specification.read("lifting").replace(frames=60 * 10**6, output={"fields": FIELDS})
    clips, samples = (1, 8) if options.quick else (12, 256)
    captured, left_out, rows = tests(options.mocap, clips), generated(spec, samples), []
    print("| minutes | clips | " + " | ".join(captured) + " | generated, left out |")
    print("|-|-|" + "-|" * (len(captured) + 1))

    def told(minutes: float, network: Lifter, clips: int) -> None:
        found = [judged(network, sequences) for sequences in captured.values()]
        inputs, truth = left_out[0]
        with torch.no_grad():
            own = 1000 * np.linalg.norm(network(inputs).numpy() - truth, axis=-1).mean()
        rows.append((minutes, clips, [*(each[0] for each in found), own]))
        cells = " | ".join(f"{plain:.0f} ({aligned:.0f})" for plain, aligned in found)
        print(f"| {minutes:g} | {clips:,} | {cells} | {own:.0f} |", flush=True)

    train(spec, options.minutes, options.bodies, told)
    if options.bodies == "own":
        draw(rows, list(captured), options.plot)


if __name__ == "__main__":
    main()
