"""Train the lifting network.

    motionenv bench free_walking.train clips.npy --minutes 40 --out network.npz

Clips come from `benchmarks.free_walking.clips`. In each step they are seen by new cameras, with noise, biased joints,
outliers and gaps. The same seed gives the same sequence of batches; their number depends on the machine's speed.
"""

import math
import time
from pathlib import Path

import numpy as np

from benchmarks import Arguments, needs, scratch

needs("torch")
import torch

import motionenv
from motionenv.body import markers
from motionenv.lifting.free.posture_network import DILATIONS, FRAMES, LEAST, RATE, features
from motionenv.mocap.keypoints.detector_errors import BIAS, SIGMA, TAIL
from motionenv.types import MARKERS

_PELVIS = MARKERS.index("pelvis")
_BATCH = 64
_OTHER = [MARKERS.index(n.replace("left_", "right_") if "left_" in n else n.replace("right_", "left_"))
          for n in MARKERS]  # fmt: skip
_ARMS = [i for i, n in enumerate(MARKERS) if n.endswith(("shoulder", "elbow", "wrist"))]
_LEGS = [i for i, n in enumerate(MARKERS) if n.endswith(("hip", "knee", "ankle"))]
#: A detector's bias, and what lasts for a while, are 0.12 of these by `motionenv/mocap/keypoints/detector_errors.toml`,
#: relative to the height; ankles have a third of the bias. Here they vary about it.
_PUBLISHED = 0.12 * SIGMA[:, None]
#: Share of the batches that are shorter than `FRAMES`, as walks across a laboratory are.
_SHORT = 0.4
#: Thighs and shanks, whose directions give the knee's angle.
_INNER, _OUTER = ([MARKERS.index(f"{side}_{joint}") for side in ("left", "right") for joint in joints]
                  for joints in (("hip", "knee"), ("knee", "ankle")))  # fmt: skip


class Network(torch.nn.Module):
    """`motionenv.lifting.free.posture_network.PostureNetwork` in PyTorch."""

    def __init__(self, inputs: int, channels: int = 192):
        super().__init__()
        conv = torch.nn.Conv1d
        self.first = conv(inputs, channels, 3, padding=1)
        self.wide = torch.nn.ModuleList([conv(channels, channels, 3, padding=d, dilation=d) for d in DILATIONS])
        self.narrow = torch.nn.ModuleList([conv(channels, channels, 1) for _ in DILATIONS])
        self.last = conv(channels, 4 * len(MARKERS), 1)

    def forward(self, values):
        """Postures (clips, frames, 15, 3) and deviations (clips, frames, 15)."""
        hidden = torch.nn.functional.silu(self.first(values.transpose(1, 2)))
        for wide, narrow in zip(self.wide, self.narrow, strict=True):
            hidden = hidden + narrow(torch.nn.functional.silu(wide(hidden)))
        out = self.last(hidden).transpose(1, 2)
        count = 3 * len(MARKERS)
        return out[..., :count].unflatten(-1, (-1, 3)), torch.nn.functional.softplus(out[..., count:]) + LEAST

    def _layers(self) -> dict[str, torch.nn.Conv1d]:
        layers = {"in": self.first, "out": self.last}
        layers |= {f"wide{i}": layer for i, layer in enumerate(self.wide)}
        return layers | {f"narrow{i}": layer for i, layer in enumerate(self.narrow)}

    def arrays(self) -> dict[str, np.ndarray]:
        """Weights as the library stores them."""
        out = {}
        for name, layer in self._layers().items():
            out[name] = layer.weight.detach().numpy().astype(np.float16)
            out[f"{name}_bias"] = layer.bias.detach().numpy().astype(np.float16)
        return out

    def take(self, arrays) -> None:
        """Go on from weights that `arrays` gave; blocks that these don't have begin by changing nothing."""
        with torch.no_grad():
            for name, layer in self._layers().items():
                if name not in arrays:
                    if name.startswith("narrow"):
                        layer.weight.zero_()
                        layer.bias.zero_()
                    continue
                layer.weight.copy_(torch.from_numpy(arrays[name].astype(np.float32)))
                layer.bias.copy_(torch.from_numpy(arrays[f"{name}_bias"].astype(np.float32)))


def batch(clips: np.ndarray, rng: np.random.Generator, size: int = _BATCH, damage: bool = True):
    """Features, target postures, which frames count, and sizes [m] of `size` clips before random cameras."""
    places = clips[rng.integers(len(clips), size=size)]
    if damage and rng.uniform() < _SHORT:
        places = _shortened(places, rng)
    there = np.isfinite(places[..., 0, 0])
    camera = _cameras(places, there, rng).astype(np.float32)
    off = places - camera[:, None, None]
    level = np.hypot(off[..., 0], off[..., 1])
    near = np.nanmin(level, axis=(1, 2)) < 1.0
    middle = np.nanmean(off[:, :, _PELVIS, :2], axis=1)
    towards = np.arctan2(middle[:, 1], middle[:, 0])
    azimuth = np.arctan2(off[..., 1], off[..., 0]) - towards[:, None, None]
    directions = np.stack([(azimuth + math.pi) % (2 * math.pi) - math.pi, np.arctan2(off[..., 2], level)], axis=-1)
    seen = np.repeat(there[..., None], len(MARKERS), axis=2)
    if damage:
        directions, seen = _damaged(directions, seen, 1.7 / np.hypot(*middle.T), rng)
    made = features(directions, seen)
    posture = places - places[:, :, [_PELVIS]]
    angle = -(made.azimuth + towards)
    c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    x, y, z = np.moveaxis(posture, -1, 0)
    target = np.stack([c * x - s * y, s * x + c * y, z], axis=-1)
    spread = np.sqrt(((target - target.mean(axis=2, keepdims=True)) ** 2).sum(axis=(2, 3)) / len(MARKERS))
    sizes = np.nanmean(spread, axis=1)
    target = np.nan_to_num(target / sizes[:, None, None, None])
    return made.values, target.astype(np.float32), there & ~near[:, None], sizes


def _shortened(places: np.ndarray, rng) -> np.ndarray:
    """The same part of a second or more, from another frame of each clip."""
    frames = int(rng.integers(RATE, FRAMES))
    spare = np.maximum(np.isfinite(places[..., 0, 0]).sum(axis=1) - frames, 0)
    return places[np.arange(len(places))[:, None], rng.integers(spare + 1)[:, None] + np.arange(frames)]


def _cameras(places, there, rng) -> np.ndarray:
    """Camera positions (size, 3) [m] around the clips."""
    middle = np.nanmean(places[:, :, _PELVIS, :2], axis=1)
    size = len(places)
    angle, distance = rng.uniform(0, 2 * math.pi, size), np.exp(rng.uniform(math.log(2.5), math.log(15), size))
    height = np.where(rng.uniform(size=size) < 0.8, rng.uniform(0.3, 2.5, size), rng.uniform(0, 0.6, size) * distance)
    return np.column_stack([middle + distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), height])


def _damaged(directions, seen, person, rng):
    """Directions with errors of a camera and a detector, and what is still seen; `person` is a body's angle [rad]."""
    size, frames, count = seen.shape
    each = person[:, None, None, None]
    some = lambda share: rng.uniform(size=(size, 1, 1, 1)) < share
    uniform = lambda: rng.uniform(size=(size, 1, 1, 1)).astype(np.float32)
    normal = lambda *shape: rng.standard_normal(shape, np.float32)
    directions = directions * np.exp(0.1 * normal(size, 1, 1, 1) * some(0.3))  # focal length
    directions[..., 1:] += 0.03 * normal(size, 1, 1, 1) * some(0.3)  # pitch
    noise = uniform() ** 2 * 0.08 * each  # 0.08: five pixels on a body 60 pixels tall
    detected = some(0.5)
    noise[detected] *= 0.2
    directions += noise * normal(*directions.shape)
    of_detector = detected[:, 0, 0, 0]
    directions[of_detector] += each[of_detector] * _lasting(int(of_detector.sum()), frames, rng)
    directions += 0.015 * each * uniform() * normal(size, 1, count, 2)
    wild = rng.uniform(size=seen.shape) < 0.02 * rng.uniform(size=(size, 1, 1))
    directions[wild] += (0.25 * each * wild[..., None])[wild] * normal(int(wild.sum()), 2)
    seen = seen & ~(rng.uniform(size=seen.shape) < (0.5 * rng.uniform(size=(size, 1, 1)) ** 2) * some(0.6)[..., 0])
    time_ = np.arange(frames)
    often = rng.uniform(size=(size, 1, 1, 1)) ** 2
    for _ in range(30):  # bursts of one joint, up to a third of all that there is to see
        begin, length = rng.integers(-9, frames, size=size), rng.integers(3, 18, size)
        gone = (time_ >= begin[:, None]) & (time_ < (begin + length)[:, None]) & some(often)[:, 0, :, 0]
        seen[np.arange(size), :, rng.integers(count, size=size)] &= ~gone
    directions, seen = _exchanged(directions, seen, rng)
    never = rng.integers(count, size=size)
    seen[np.arange(size), :, never] &= ~some(0.15)[:, 0, :, 0]
    begin, length = rng.integers(frames, size=size), rng.integers(2, 10, size)
    gone = (time_ >= begin[:, None]) & (time_ < (begin + length)[:, None]) & some(0.2)[:, 0, :, 0]
    return directions, seen & ~gone[..., None]


def _exchanged(directions, seen, rng):
    """Directions, and what is seen, with left and right confused for a while: of arms, of legs, or of one joint."""
    size, frames, count = seen.shape
    time_ = np.arange(frames)
    order = np.tile(np.arange(count), (size, frames, 1))
    wholes = [(group, 0.12, 20) for group in (_ARMS, _LEGS, _ARMS + _LEGS)]
    for group, share, longest in wholes + [([i, _OTHER[i]], 0.25, 5) for i in range(count) if i < _OTHER[i]]:
        begin, length = rng.integers(frames, size=size), rng.integers(1, longest, size)
        mixed = (time_ >= begin[:, None]) & (time_ < (begin + length)[:, None]) & (rng.uniform(size=(size, 1)) < share)
        others = order[..., [_OTHER[i] for i in group]]
        order[..., group] = np.where(mixed[..., None], others, order[..., group])
    return np.take_along_axis(directions, order[..., None], axis=2), np.take_along_axis(seen, order, axis=2)


def _lasting(size: int, frames: int, rng) -> np.ndarray:
    """Errors (size, frames, 15, 2) of a detector, relative to the height: a bias, what lasts a while, and misses."""
    scale = rng.uniform(0.3, 1.4, (2, size, 1, 1, 1)) * _PUBLISHED
    bias = scale[0] * BIAS[:, None] * rng.standard_normal((size, 1, len(MARKERS), 2))
    memory = np.exp(rng.uniform(math.log(0.1), math.log(0.8), (size, 1, 1)))  # [s]
    keep = np.exp(-1 / (RATE * memory)).astype(np.float32)
    normal = rng.standard_normal((frames, size, len(MARKERS), 2), np.float32)
    for t in range(1, frames):
        normal[t] = keep * normal[t - 1] + np.sqrt(1 - keep**2) * normal[t]
    normal = normal.swapaxes(0, 1)
    squared = (normal**2).sum(axis=-1, keepdims=True)
    error = bias + scale[1] * normal * np.sqrt(TAIL * np.expm1(squared / TAIL) / squared)
    missed = rng.uniform(size=(size, frames, len(MARKERS), 1)) < 0.03 * rng.uniform(size=(size, 1, 1, 1))
    missed[:, 1:] |= missed[:, :-1]
    missed[:, 2:] |= missed[:, :-2]
    return error + missed * 6 * _PUBLISHED * rng.standard_normal((size, 1, len(MARKERS), 2))


def loss_of(posture, deviation, target, counts):
    """Laplace's negative log-likelihood, distance, velocity, and legs' limbs, averaged over what counts."""
    weight = counts[..., None] / (counts.sum() * posture.shape[2])
    apart = _size(posture - target)
    likely = ((apart / deviation + 2 * torch.log(deviation)) * weight).sum()
    off = posture - target
    speed = _size(off[:, 1:] - off[:, :-1])
    both = weight[:, 1:] * counts[:, :-1, None]
    limbs = (_size(off[:, :, _OUTER] - off[:, :, _INNER]).mean(dim=2) * counts).sum() / counts.sum()
    return likely + 4 * (apart * weight).sum() + 2 * (speed * both).sum() + 2 * limbs, apart


def _size(ways):
    return (ways**2).sum(-1).clamp(min=1e-8).sqrt()


def trained(clips: np.ndarray, minutes: float, seed: int, start: Path | None = None, rate: float = 1.5e-3) -> Network:
    """A network that has learned from `clips` for so long, from scratch or from the weights of a file."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    network = Network(batch(clips, rng, 1)[0].shape[-1])
    if start is not None:
        network.take(np.load(start))
    optimiser = torch.optim.AdamW(network.parameters(), 1e-3, weight_decay=1e-4)
    begun, step, errors = time.time(), 0, []
    while (share := (time.time() - begun) / (60 * minutes)) < 1:
        for group in optimiser.param_groups:
            group["lr"] = rate * min(1.0, (step + 1) / 200) * 0.5 * (1 + math.cos(math.pi * share)) + 1e-5
        values, target, counts, sizes = batch(clips, rng)
        with torch.autocast("cpu", torch.bfloat16):
            posture, deviation = network(torch.from_numpy(values))
        loss, apart = loss_of(posture.float(), deviation.float(), torch.from_numpy(target), torch.from_numpy(counts))
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        step += 1
        errors.append(1000 * float((apart.detach().numpy().mean(-1) * sizes[:, None])[counts].mean()))
        if step % 500 == 0:
            print(f"{step} steps, {60 * minutes * share:.0f} s: {np.mean(errors[-500:]):.1f} mm", flush=True)
    return network


def drawn_walks(count: int) -> np.ndarray:
    """Clips (count, frames, 15, 3) [m] of walks of walk/fpca."""
    walks = [motionenv.synthesize("walk/fpca", FRAMES / RATE, RATE, seed=seed) for seed in range(count)]
    return np.stack([markers(walk.poses, walk.skeleton) for walk in walks])


def main() -> None:
    """Train on clips, report errors on 300 of them that are left out, and write the weights."""
    parser = Arguments(__doc__)
    parser.add_argument("clips", type=Path, nargs="*", help="files of `clips`; --quick needs none")
    parser.add_argument("--minutes", type=float, default=40.0, quick=0.01)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=Path, help="weights to go on from")
    parser.add_argument("--rate", type=float, default=1.5e-3, help="of learning, at first")
    parser.add_argument("--out", type=Path, required=True, quick=scratch() / "network.npz")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    if not asked.clips and not asked.quick:
        parser.error("name one file of clips or more")
    clips = np.concatenate([np.load(path) for path in asked.clips]) if asked.clips else drawn_walks(12)
    order = np.random.default_rng(asked.seed).permutation(len(clips))
    left_out = min(300, len(clips) // 2)
    held = clips[order[:left_out]]
    network = trained(clips[order[left_out:]], asked.minutes, asked.seed, asked.start, asked.rate)
    for damage in (False, True):
        values, target, counts, sizes = batch(held, np.random.default_rng(5), 2 * left_out, damage)
        with torch.no_grad():
            posture, _ = network(torch.from_numpy(values))
        apart = np.linalg.norm(posture.numpy() - target, axis=-1).mean(-1) * sizes[:, None]
        print(f"{'damaged' if damage else 'clean'}: {1000 * apart[counts].mean():.1f} mm on clips left out")
    np.savez(asked.out, **network.arrays())


if __name__ == "__main__":
    main()
