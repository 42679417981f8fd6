"""Anderson acceleration of linearly convergent fixed-point iterations such as EM (Anderson 1965; Walker & Ni 2011)."""

import numpy as np

DEPTH = 5  # number of former iterations used


class Anderson:
    """Extrapolates x ← g(x): proposes the mixture of the last images g(x) whose residuals g(x) - x cancel best.

    A proposal may raise the objective. The caller must check, and then `forget` and continue from the plain g(x).
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Discard the history."""
        self.images: list[np.ndarray] = []
        self.residuals: list[np.ndarray] = []

    def propose(self, x: np.ndarray, image: np.ndarray) -> np.ndarray:
        """The next point, given the last one `x` and its `image` g(x), arrays of one shape."""
        self.images = [*self.images[-DEPTH:], image]
        self.residuals = [*self.residuals[-DEPTH:], image - x]
        if len(self.images) == 1:
            return image
        change = np.stack([(self.residuals[-1] - r).ravel() for r in self.residuals[:-1]])
        gram = change @ change.T
        gram[np.diag_indices_from(gram)] *= 1 + 1e-10
        weights = np.linalg.lstsq(gram, change @ self.residuals[-1].ravel(), rcond=None)[0]
        steps = np.stack([image - former for former in self.images[:-1]])
        return image - np.tensordot(weights, steps, axes=1)
