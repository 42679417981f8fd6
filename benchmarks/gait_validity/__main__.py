"""Gait of drawn people against published norms: curves of hip, knee and pelvis, and step parameters at several speeds.

    motionenv bench gait_validity [--model walk/fpca] [--people 1000] [--figure renders/gait.png]

Norms of the curves are in norms.csv (Schwartz, Rozumalski & Trost 2008, free speed; children and adolescents,
whose curves differ from adults' by less than the standard deviation: knee 6°, 19° and 59° at contact, in stance and in
swing, Winter 1991: about 4°, 19° and 62°). Two conventions differ from Plug-in Gait's. The pelvis is the
body's trunk, which stands upright, while the plane of ASIS and PSIS leans forward by 12°: tilt is compared about its
mean, and the hip's flexion by that of the thigh against the vertical, in the norm hip flexion less pelvic tilt.

Norms of step parameters: walk ratio 0.0040 to 0.0065 m/(steps/min) (Sekiya & Nagasaki 1998, Bogen et al. 2018), bob
3 to 6 cm (Gard & Childress 2001), comfortable speed 1.2 to 1.43 m/s (Bohannon & Williams Andrews 2011). Pace
and walk ratio are drawn from published distributions (`motionenv.models.people.population`). How far steps reach and
how knees bend with speed (`motionenv.models.people.pace`) were set while looking at the rows of walk/fpca.

A last table says where the knee's flexion comes from: the average walker's at the pace of those captured and at 1.3
m/s, and that of people drawn at the same speeds.
"""

import warnings
from pathlib import Path

import numpy as np

import motionenv
from benchmarks import Arguments, scratch
from motionenv.body.kinematics import feet, forward
from motionenv.body.skeleton import NODES
from motionenv.errors import ExtrapolationWarning
from motionenv.gait import Stretch, Stride, feet_of, find_events, find_strides, normalised
from motionenv.lifting.plot import BLUE, GREY, new_figure
from motionenv.types import POSE, Motion

SECONDS, FPS = 8.0, 100.0
SPEEDS = (0.6, 0.9, 1.3, 1.65, 2.2)
ANGLES = {
    "hip_flexion": "thigh against the vertical",
    "knee_flexion": "knee flexion",
    "pelvis_tilt": "pelvis tilt about its mean",
    "pelvis_obliquity": "pelvis obliquity",
    "pelvis_rotation": "pelvis rotation",
}
KNEES = [POSE.index(f"{side}_knee_flexion") for side in ("left", "right")]
STRAIGHT, BENT = -0.5, 75.0  # [degrees] between which knees belong
MOST_SLIP = 0.02  # [m]


def norms() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Percent (20,), means and standard deviations (20, 5) [degrees] of `ANGLES`."""
    table = np.loadtxt(Path(__file__).with_name("norms.csv"), delimiter=",", skiprows=3)
    mean, deviation = table[:, 1::2].copy(), table[:, 2::2]
    mean[:, 0] -= mean[:, 2]
    mean[:, 2] -= mean[:, 2].mean()
    return table[:, 0], mean, deviation


def angles(motion: Motion, side: str) -> np.ndarray:
    """`ANGLES` of one side (frames, 5) [degrees], with Plug-in Gait's signs."""
    nodes = forward(motion.poses, motion.skeleton)[0]
    thigh = nodes[:, NODES.index(f"{side}_knee")] - nodes[:, NODES.index(f"{side}_hip")]
    tilt, obliquity, heading = motion.poses[:, 3:6].T
    left = 1.0 if side == "left" else -1.0
    knee = motion.poses[:, POSE.index(f"{side}_knee_flexion")]
    found = [np.arctan2(thigh[:, 0], -thigh[:, 2]), knee, tilt - tilt.mean(), left * obliquity, -left * heading]
    return np.degrees(np.column_stack(found))


def strides_of(motion: Motion) -> tuple[Stride, ...]:
    """Strides of a walk that is steady throughout."""
    seen = feet_of(motion)
    return find_strides(seen, find_events(seen), (Stretch(0.0, motion.seconds, "steady"),))


def slips_of(motion: Motion, strides) -> list[float]:
    """By how much the ball of the foot moves [m] while it alone bears the body, in each stride."""
    balls, found = feet(motion.poses, motion.skeleton)[1][..., :2], []
    for stride in strides:
        span = np.array([stride.opposite_off, stride.opposite_contact]) * motion.fps
        if np.isfinite(span).all():
            way = balls[int(np.ceil(span[0])) : int(span[1]) + 1, int(stride.side == "right")]
            found.append(float(np.hypot(*np.ptp(way, axis=0))))
    return found


def measured(motion: Motion) -> tuple[np.ndarray, dict[str, float]]:
    """Mean curves (101, 5) [degrees] and step parameters of one walk."""
    strides = strides_of(motion)
    sides = [[s for s in strides if s.side == side] for side in ("left", "right")]
    cut = [normalised(angles(motion, side), FPS, mine) for side, mine in zip(("left", "right"), sides, strict=True)]
    curves = np.nanmean(np.concatenate(cut), axis=0)
    seconds, length = (float(np.mean([getattr(s, name) for s in strides])) for name in ("seconds", "length"))
    heights = normalised(motion.poses[:, 2:3], FPS, strides)[..., 0]
    knees = np.degrees(motion.poses[:, KNEES])
    x = motion.poses[:, 0]
    return curves, {
        "speed": float(x[-1] - x[0]) * FPS / (len(x) - 1),
        "cadence": 120 / seconds,
        "step length": 0.5 * length,
        "walk ratio": 0.5 * length * seconds / 120,
        "bob": float(np.nanmean(np.ptp(heights, axis=1))),
        "slip": max(slips_of(motion, strides), default=np.nan),
        "straightest": float(knees.min()),
        "most bent": float(knees.max()),
        "height": motion.skeleton.height,
    }


def drawn(name: str, people: int, speed: float | None) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Curves (people, 101, 5) and step parameters (people,) of drawn people, at their own pace or at a speed."""
    model = motionenv.load(name)
    found = []
    for seed in range(people):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ExtrapolationWarning)
            found.append(measured(model.synthesize(SECONDS, FPS, seed=seed, speed=speed)))
    return np.array([c for c, _ in found]), {key: np.array([p[key] for _, p in found]) for key in found[0][1]}


def inside(curves: np.ndarray) -> np.ndarray:
    """Share of the cycle (5,) in which the mean of curves (people, 101, 5) is within the norm's standard deviation."""
    percent, mean, deviation = norms()
    ours = curves.mean(axis=0)[percent.astype(int)]
    return np.mean(np.abs(ours - mean) <= deviation, axis=0)


def row(parameters: dict[str, np.ndarray], label: str, wanted: float | None) -> str:
    """One line of the table of step parameters."""
    p = parameters
    ratios = np.mean((p["walk ratio"] > 0.0040) & (p["walk ratio"] < 0.0065))
    straight, bent = np.mean(p["straightest"] < STRAIGHT), np.mean(p["most bent"] > BENT)
    off = "" if wanted is None else f" (worst {100 * np.abs(p['speed'] / wanted - 1).max():.1f} % off)"
    slips = 100 * np.nanpercentile(p["slip"], [50, 100])
    low, middle, high = 100 * np.percentile(p["bob"], [5, 50, 95])
    return (
        f"| {label} | {p['speed'].mean():.2f}{off} | {p['cadence'].mean():.0f} | {p['step length'].mean():.2f} | "
        f"{p['walk ratio'].mean():.4f} | {ratios:.1%} | {middle:.1f} ({low:.1f} to {high:.1f}) | "
        f"{slips[0]:.1f} / {slips[1]:.1f}, {np.mean(p['slip'] > MOST_SLIP):.1%} | "
        f"{np.median(p['most bent']):.0f} | {straight:.1%} / {bent:.1%} |"
    )


def knee_shape(knee: np.ndarray) -> str:
    """Cells of a knee's curve (101,) [degrees]: at contact, most in loading, least in stance, most in swing."""
    return " | ".join(f"{v:.1f}°" for v in (knee[0], knee[5:30].max(), knee[25:60].min(), knee[55:95].max()))


def print_knees(name: str, people: int) -> None:
    """Print the average walker's knee at its own pace and at 1.3 m/s, and that of as many `people` drawn there."""
    model = motionenv.load(name)
    average = model.walker(deviations=[])
    own = measured(model.synthesize(SECONDS, FPS, walker=average, variation=0.0))
    speeds = (own[1]["speed"], SPEEDS[2])
    print("\n| knee | speed [m/s] | contact | loading | stance | swing |\n|-|-|-|-|-|-|")
    for speed in speeds:
        walk = model.synthesize(SECONDS, FPS, walker=average, variation=0.0, speed=speed)
        print(f"| average walker | {speed:.2f} | {knee_shape(measured(walk)[0][:, 1])} |")
        mean = drawn(name, people, speed)[0][..., 1].mean(axis=0)
        print(f"| {people} drawn people | {speed:.2f} | {knee_shape(mean)} |")


def figure(curves: np.ndarray, path: Path) -> None:
    """Curves of drawn people over the norm's band, one panel for each angle."""
    percent, mean, deviation = norms()
    percent, mean, deviation = np.append(percent, 100), *(np.vstack([a, a[:1]]) for a in (mean, deviation))
    drawing, axes = new_figure(2, 3, (10.0, 5.4))
    panels = [*axes[0, :2], *axes[1]]
    for i, (panel, label) in enumerate(zip(panels, ANGLES.values(), strict=True)):
        low, high = mean[:, i] - deviation[:, i], mean[:, i] + deviation[:, i]
        panel.fill_between(percent, low, high, color=GREY, alpha=0.35, linewidth=0, label="norm ± 1 SD")
        ours, spread = curves[..., i].mean(axis=0), curves[..., i].std(axis=0)
        panel.plot(np.arange(101), ours, color=BLUE, label="drawn people ± 1 SD")
        panel.plot(np.arange(101), np.column_stack([ours - spread, ours + spread]), color=BLUE, linewidth=0.6)
        panel.set(title=label)
    for panel in axes[1]:
        panel.set_xlabel("gait cycle [%]")
    for panel in axes[:, 0]:
        panel.set_ylabel("angle [°]")
    axes[0, 2].set_axis_off()
    axes[0, 2].legend(*panels[0].get_legend_handles_labels(), loc="center left", frameon=False)
    drawing.savefig(path, dpi=90)


def main() -> None:
    """Print the tables."""
    parser = Arguments(__doc__)
    parser.add_argument("--model", default="walk/fpca", help="name of a walking model")
    parser.add_argument(
        "--people", type=int, default=1000, quick=2, help="number of people at their own pace; a fifth at each speed"
    )
    parser.add_argument("--figure", type=Path, quick=scratch() / "gait.png", help="picture to write")
    asked = parser.parse_args()
    curves, parameters = drawn(asked.model, asked.people, None)
    heights = parameters["height"]
    print(f"{asked.model}: {asked.people} people of {heights.mean():.2f} ± {heights.std():.2f} m")
    print("\n| angle | within the norm's ± 1 SD | at contact | least | most |\n|-|-|-|-|-|")
    mean = curves.mean(axis=0)
    for name, share, ours in zip(ANGLES.values(), inside(curves), mean.T, strict=True):
        print(f"| {name} | {share:.0%} of the cycle | {ours[0]:.1f}° | {ours.min():.1f}° | {ours.max():.1f}° |")
    print(
        "\n| pace | speed [m/s] | cadence | step [m] | walk ratio | in range | bob [cm], 5 to 95 % | slip [cm], median "
        "/ worst, over 2 cm | knee, most | knees straight / over 75° |\n" + "|-" * 10 + "|"
    )
    print(row(parameters, f"their own, ± {parameters['speed'].std():.2f}", None))
    for speed in SPEEDS:
        print(row(drawn(asked.model, max(asked.people // 5, 1), speed)[1], f"{speed:g}", speed))
    print_knees(asked.model, max(asked.people // 5, 1))
    if asked.figure:
        figure(curves, asked.figure)


if __name__ == "__main__":
    main()
