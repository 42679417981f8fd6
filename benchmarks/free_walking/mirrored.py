"""How well misfits tell whether left and right are exchanged in all points, and with which log-odds.

    motionenv bench free_walking.mirrored --network a.npz --models A B [--count 14]

Clips of people left out (see `left_out`), of 0.5 to 4 s, are lifted as they are and with all sides exchanged. Logistic
regression through the origin on log(misfit exchanged / misfit as it is) gives `lifter._EVIDENCE`; the table tells how
often the wrong one fits better, the least log-ratio, and the mean probability that the right one is given.
"""

import numpy as np
from scipy.optimize import minimize_scalar

from benchmarks.free_walking import bandai, left_out
from motionenv.lifting.free.lifter import fit_labelled
from motionenv.lifting.free.posture_network import PostureNetwork
from motionenv.lifting.side_labels import swapped_back
from motionenv.types import Points

SECONDS = (0.5, 1.0, 2.0, 4.0)


def evidence(sequence: left_out.Sequence, seconds: float, network: PostureNetwork, known: bool) -> float:
    """log(misfit with sides exchanged / misfit as they are) of the beginning of a sequence."""
    frames = round(seconds * sequence.points.fps)
    points = Points(sequence.points.positions[:frames], sequence.points.fps, "px")
    exchanged = swapped_back(points, np.ones((len(points.positions), 2), dtype=bool))
    down = bandai.elevation(sequence.camera)
    fits = [
        fit_labelled(network, given, sequence.camera if known else None, elevation=down, swaps=False)
        for given in (points, exchanged)
    ]
    return float(np.log(fits[1].misfit / fits[0].misfit))


def main() -> None:
    """Print the table and the regression."""
    parser = left_out.arguments(__doc__, models=True)
    parser.add_argument("--count", type=int, default=14, quick=1)
    asked = parser.parse_args()
    network = left_out.network(asked.network)
    people = left_out.varied(asked.mocap, tuple(asked.models), asked.count)
    people += left_out.captured(asked.mocap)[: asked.count]
    sequences = list(left_out.sequences(people))
    found = {}
    for known in (True, False):
        for seconds in SECONDS[:2] if asked.quick else SECONDS:
            each = [evidence(sequence, seconds, network, known) for sequence in sequences]
            found["camera known" if known else "camera unknown", seconds] = np.array(each)
    pooled = np.concatenate(list(found.values()))
    slope = minimize_scalar(lambda k: np.logaddexp(0, -k * pooled).sum(), bounds=(0, 500), method="bounded").x
    print(f"log-odds: {slope:.1f} times the logarithm of the misfits' ratio")
    print("| camera | seconds | wrong one fits better | least log-ratio | mean probability of the right one |")
    print("|-|-|-|-|-|")
    for (camera, seconds), values in found.items():
        right = 1 / (1 + np.exp(-slope * values))
        print(f"| {camera} | {seconds:g} | {(values < 0).mean():.0%} | {values.min():.3f} | {right.mean():.2f} |")


if __name__ == "__main__":
    main()
