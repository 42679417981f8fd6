"""Compiled inference with smooth residuals (`motionenv.models.fpca.gaussian`)."""

import numpy as np

from motionenv._core.compilation import kernel, part

sums = part(fastmath={"reassoc", "contract"})  # don't rely on NaN


@sums
def _root(a):
    """Replace the lower triangle of a positive definite matrix by its Cholesky root; returns log det."""
    log_det = 0.0
    for i in range(len(a)):
        for j in range(i + 1):
            total = a[i, j]
            for h in range(j):
                total -= a[i, h] * a[j, h]
            a[i, j] = total / a[j, j] if j < i else np.sqrt(total)
        log_det += 2 * np.log(a[i, i])
    return log_det


@sums
def _forward(root, x):
    """Replace the columns of x (J, c) by root⁻¹ x."""
    for i in range(len(root)):
        for c in range(x.shape[1]):
            total = x[i, c]
            for h in range(i):
                total -= root[i, h] * x[h, c]
            x[i, c] = total / root[i, i]


@sums
def _backward(root, x):
    """Replace the columns of x (J, c) by root⁻ᵀ x."""
    for i in range(len(x) - 1, -1, -1):
        for c in range(x.shape[1]):
            total = x[i, c]
            for h in range(i + 1, len(x)):
                total -= root[h, i] * x[h, c]
            x[i, c] = total / root[i, i]


@sums
def _less_squares(x, out):
    """Subtract the lower triangle of xᵀ x, of x (J, c), from `out` (c, c)."""
    for h in range(len(x)):
        for i in range(x.shape[1]):
            for j in range(i + 1):
                out[i, j] -= x[h, i] * x[h, j]


@part
def _project(x, basis, loading, products, both):
    """Add the seen samples of x (P,) to xᵀ [W, x], the last row of `products`, and to Bᵀ x, the last column of `both`.

    Returns their number.
    """
    n, q = 0, loading.shape[1]
    for p in range(len(x)):
        if x[p] == x[p]:
            n += 1
            products[q, q] += x[p] * x[p]
            for i in range(q):
                products[q, i] += loading[p, i] * x[p]
            for i in range(basis.shape[1]):
                both[i, q] += basis[p, i] * x[p]
    return n


@sums
def _add(row, loading, sign, products, gram, both):
    """Add one sample, or subtract it, to Wᵀ W, Bᵀ B and Bᵀ W: lower triangles."""
    for i in range(len(loading)):
        for j in range(i + 1):
            products[i, j] += sign * loading[i] * loading[j]
    for i in range(len(row)):
        scaled = sign * row[i]
        for j in range(i + 1):
            gram[i, j] += scaled * row[j]
        for j in range(len(loading)):
            both[i, j] += scaled * loading[j]


@part
def _channel(x, basis, loading, whole, products, spectrum, white, root, both):
    """Integrate the smooth part of one channel's residual out of its seen samples.

    `x` (P,) are deviations from the mean, NaN where missing; `loading` W (P, q); `whole` (J, q) Bᵀ W over all samples.
    Output: the root of M = σ² Ψ⁻¹ + Bᵀ B (J, J), and `both` = root⁻¹ [Bᵀ W, Bᵀ x] (J, q + 1). In `products` (q + 1,
    q + 1), Wᵀ W over all samples becomes [W, x]ᵀ [W, x] over the seen ones. Returns their number, and log det of their
    covariance given the latents.
    """
    n_columns, q = basis.shape[1], loading.shape[1]
    root[:], both[:] = 0.0, 0.0
    n = _project(x, basis, loading, products, both)
    few = 2 * n < len(x)  # add what is seen, or leave out what isn't
    if few:
        products[:q, :q] = 0.0
    else:
        both[:, :q] = whole
        for i in range(n_columns):
            root[i, i] = 1.0
    for p in range(len(x)):
        if (x[p] == x[p]) == few:
            _add(basis[p], loading[p], 1.0 if few else -1.0, products, root, both)
    log_det = n * np.log(white)
    for i in range(n_columns):
        root[i, i] += white / spectrum[i]
        log_det += np.log(spectrum[i] / white)
    log_det += _root(root)
    _forward(root, both)
    return n, log_det


@part
def _latents(x, model, state, z):
    """Posterior N(z, S) of the latents (q, 1) of one cycle x (P, m); returns log p(x).

    `state`, output: of each channel the root of M (m, J, J), root⁻¹ [Bᵀ W, Bᵀ x] (m, J, q + 1), the products
    [W, x]ᵀ (I - B M⁻¹ Bᵀ) [W, x] (m, q + 1, q + 1), lower triangles, and the number of seen samples (m,); the root of
    S⁻¹ (q, q).
    """
    basis, loadings, spectrum, white, wholes, squares = model
    roots, pairs, inners, numbers, precision = state
    q, minus_twice, n_seen = len(z), 0.0, 0
    precision[:], z[:], inners[:] = np.eye(q), 0.0, 0.0
    for a in range(x.shape[1]):
        both, inner = pairs[a], inners[a]
        inner[:q, :q] = squares[a]
        n, log_det = _channel(x[:, a], basis, loadings[a], wholes[a], inner, spectrum[a], white[a], roots[a], both)
        numbers[a], n_seen, minus_twice = n, n_seen + n, minus_twice + log_det
        _less_squares(both, inner)
        for i in range(q):
            z[i, 0] += inner[q, i] / white[a]
            for j in range(i + 1):
                precision[i, j] += inner[i, j] / white[a]
        minus_twice += inner[q, q] / white[a]
    minus_twice += _root(precision) + n_seen * np.log(2 * np.pi)
    _forward(precision, z)
    for i in range(q):
        minus_twice -= z[i, 0] * z[i, 0]
    _backward(precision, z)
    return -0.5 * minus_twice if n_seen else 0.0


@part
def _state(model):
    """Space for what `_latents` finds."""
    (m, n_columns, q) = model[4].shape
    roots, pairs = np.empty((m, n_columns, n_columns)), np.empty((m, n_columns, q + 1))
    return roots, pairs, np.empty((m, q + 1, q + 1)), np.empty(m), np.empty((q, q))


@sums
def _inverse(root, out):
    """Inverse of root rootᵀ."""
    inverse, squares = np.eye(len(root)), np.zeros(root.shape)
    _forward(root, inverse)
    _less_squares(inverse, squares)
    for i in range(len(root)):
        for j in range(len(root)):
            out[i, j] = -squares[max(i, j), min(i, j)]


@sums
def _smooth(root, both, z, u):
    """Coefficients u (J, 1) of the smooth part of a channel's residual, given the latents z (q, 1)."""
    q = len(z)
    for i in range(len(u)):
        u[i, 0] = both[i, q]
        for j in range(q):
            u[i, 0] -= both[i, j] * z[j, 0]
    _backward(root, u)


@sums
def _expect(root, both, inner, spectrum, white, z, covariance, smooth):
    """Add E[u²] of a channel's smooth part to `smooth` (J,); returns E[Σ ε²] of its white noise at the seen samples.

    With D = M⁻¹ Bᵀ W, u has the covariance σ² M⁻¹ + D S Dᵀ, and by Bᵀ B = M - σ² Ψ⁻¹ the sum is E[[-z, 1]ᵀ inner
    [-z, 1]] + σ² J - σ² Σ E[u²] / ψ.
    """
    n_columns, q = len(root), len(z)
    u, d, left = np.empty((n_columns, 1)), both[:, :q].copy(), np.empty((n_columns, n_columns))
    _smooth(root, both, z, u)
    _inverse(root, left)
    _backward(root, d)
    square = inner[q, q] + white * n_columns
    for i in range(q):
        square -= 2 * inner[q, i] * z[i, 0]
        for j in range(q):
            square += inner[max(i, j), min(i, j)] * (z[i, 0] * z[j, 0] + covariance[i, j])
    for h in range(n_columns):
        second = u[h, 0] * u[h, 0] + white * left[h, h]
        for i in range(q):
            for j in range(q):
                second += d[h, i] * covariance[i, j] * d[h, j]
        smooth[h] += second
        square -= white / spectrum[h] * second
    return square


@kernel
def infer(start, stop, values, groups, means, model, found, smooth, rest):
    """Posterior of the latents of cycles `start` to `stop`, their likelihood, and what the residuals' model needs.

    `values` (K, P, m) less the `means` (G, P, m) of their groups. `model`: basis (P, J), loadings W (m, P, q), spectrum
    (m, J), white (m,), and of all samples Bᵀ W (m, J, q) and Wᵀ W (m, q, q). `found`, output: means (K, q, 1) and
    covariances (K, q, q) of the latents, and log p (K,) of the seen samples. Accumulated unless empty: `smooth` (m, J)
    E[u²], and `rest` (m, 3) E[Σ ε²], the number of seen samples, and that of cycles that show any.
    """
    zs, covariances, log_p = found
    spectrum, white, state = model[2], model[3], _state(model)
    roots, pairs, inners, numbers, precision = state
    for k in range(start, stop):
        log_p[k] = _latents(values[k] - means[groups[k]], model, state, zs[k])
        _inverse(precision, covariances[k])
        for a in range(len(rest)):
            if numbers[a]:
                rest[a, 0] += _expect(
                    roots[a], pairs[a], inners[a], spectrum[a], white[a], zs[k], covariances[k], smooth[a]
                )
                rest[a, 1] += numbers[a]
                rest[a, 2] += 1.0


@sums
def _deviation(row, loading, root, both, white, precision, w, h):
    """Standard deviation of a missing sample, whose errors are w (J, 1) of the smooth part and h (q, 1) of latents."""
    w[:, 0], h[:, 0] = row, loading
    _forward(root, w)
    for i in range(len(h)):
        for c in range(len(w)):
            h[i, 0] -= both[c, i] * w[c, 0]
    _forward(precision, h)
    return np.sqrt(white * (1 + (w * w).sum()) + (h * h).sum())


@sums
def _most(normals, first, last, w, h, noise, deviation, most):
    """Raise `most` (draws,) to a missing sample's |error| / deviation in each of the draws."""
    q = len(h)
    for d in range(len(normals)):
        off = noise * normals[d, last]
        for i in range(q):
            off += h[i, 0] * normals[d, i]
        for i in range(len(w)):
            off += noise * w[i, 0] * normals[d, first + i]
        most[d] = max(most[d], abs(off) / deviation)


@kernel
def fill(start, stop, values, groups, means, model, normals, level, filled, width):
    """Expected values of missing samples, given the seen ones, into `filled` (K, P, m), which holds `values`.

    With `normals` (draws, q + J·m + P·m), which may be empty, `width` (K, P, m) gets the standard deviations of missing
    samples times the quantile `level` of the draws' largest |error| / deviation over each cycle; without, times 1.
    """
    (_, p, m), q, n_columns = values.shape, model[1].shape[2], model[0].shape[1]
    (basis, loadings, _, white), state = model[:4], _state(model)
    roots, pairs, _, _, precision = state
    z, u, w, h = np.empty((q, 1)), np.empty((n_columns, 1)), np.empty((n_columns, 1)), np.empty((q, 1))
    most = np.zeros(len(normals))
    for k in range(start, stop):
        mean, most[:] = means[groups[k]], 0.0
        _latents(values[k] - mean, model, state, z)
        for a in range(m):
            _smooth(roots[a], pairs[a], z, u)
            for j in range(p):
                if np.isnan(values[k, j, a]):
                    row, loading = basis[j], loadings[a, j]
                    filled[k, j, a] = mean[j, a] + (loading * z[:, 0]).sum() + (row * u[:, 0]).sum()
                    width[k, j, a] = _deviation(row, loading, roots[a], pairs[a], white[a], precision, w, h)
                    last = q + m * n_columns + j * m + a
                    noise = np.sqrt(white[a])
                    _most(normals, q + a * n_columns, last, w, h, noise, width[k, j, a], most)
        if len(normals):
            width[k] *= np.quantile(most, level)
