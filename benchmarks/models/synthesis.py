"""Frames per second of walking synthesis: 1,000 four-second walks from walk/fpca.

    motionenv bench models.synthesis [--walks 1000] [--seed 0]

The baseline is a textbook loop over walks and frames: evaluate the Fourier series of mean and components with NumPy,
compute forward kinematics of the pose, and move the root by the motion of the lower foot. It does less than ours: no
smooth contact, no planted feet, and no variation between cycles. It is timed on a few walks of the same walkers, since
its frames per second don't depend on their number.
"""

import numpy as np

import motionenv
from benchmarks import Arguments, headline, shortest
from motionenv.body import forward

SECONDS = 4
BASELINE_WALKS = 5


def frame_by_frame(model, stride, fps: int) -> np.ndarray:
    """Poses (n, frames, 25) of the walkers in `stride`, one frame at a time."""
    fpca, body = model.fpca_, model.skeleton()
    terms = np.concatenate([fpca.mean_coefficients_[None], fpca.component_coefficients_])
    k = np.arange(1, (terms.shape[1] + 1) // 2)
    poses = np.zeros((len(stride.seconds), SECONDS * fps, 25))
    for walk, scores, seconds in zip(poses, stride.scores, stride.seconds, strict=True):
        ankles = None
        for i, pose in enumerate(walk):
            angle = 2 * np.pi * k * i / (fps * seconds)
            columns = np.concatenate([[np.sqrt(0.5)], np.cos(angle), np.sin(angle)]) * np.sqrt(2 / len(fpca.mean_))
            channels = np.concatenate([[1.0], scores]) @ (columns @ terms)
            pose[6:], pose[3:6] = channels[:19], channels[19:22]
            before, ankles = ankles, forward(pose, body)[0][13:15]
            lower = ankles[:, 2].argmin()
            pose[2] = channels[22 + lower] * body.height - ankles[lower, 2]
            if before is not None:
                pose[:2] = walk[i - 1, :2] + before[lower, :2] - ankles[lower, :2]
    return poses


def main() -> None:
    """Print the table."""
    parser = Arguments(__doc__)
    parser.add_argument("--walks", type=int, default=1000, quick=5)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    model = motionenv.load("walk/fpca")
    stride = model.sample(BASELINE_WALKS, seed=asked.seed)
    model.walks(1, 30, n=2, seed=0)  # compiles
    frame_by_frame(model, stride, 2)
    print(f"{asked.walks:,} walks of {SECONDS} s: frames per second\n")
    print("| fps | ours | ours, one walk at a time | loop over frames | ours / loop |\n|-|-|-|-|-|")
    for fps in (30, 60):
        frames = SECONDS * fps
        crowd = asked.walks * frames / shortest(lambda fps=fps: model.walks(SECONDS, fps, n=asked.walks, seed=0), 3)
        single = frames / shortest(lambda fps=fps: model.synthesize(SECONDS, fps, seed=0), 20)
        loop = BASELINE_WALKS * frames / shortest(lambda fps=fps: frame_by_frame(model, stride, fps), 2)
        print(f"| {fps} | {crowd:,.0f} | {single:,.0f} | {loop:,.0f} | {crowd / loop:.0f}× |")
        if fps == 30:
            headline(frames=crowd / 1e6, ratio=crowd / loop)


if __name__ == "__main__":
    main()
