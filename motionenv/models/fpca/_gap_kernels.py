"""Compiled passes over cycles with gaps, for `em_fit`, `svd_fit`, `observations` and `model`.

Sample (p, a) of a cycle has the index d = p·m + a. A gap is a run (first, last) of missing samples of one channel:
`first` is the index of its first sample, `last` that just after its end. With T the cumulative sums over p of any
function of the samples, (P + 1)·m rows, the sum over a gap is T[last] - T[first]. So a pass costs time by the number of
gaps, not of samples. Conversely, to add a value to every sample of a gap, the passes add it at `first`, subtract it at
`last`, and take cumulative sums at the end.

Symmetric q × q matrices are stored as their lower triangle, row by row.
"""

import numpy as np

from motionenv._core.compilation import kernel

# The compiler may reorder sums, equally in each run; these kernels don't rely on NaN.
sums = kernel(fastmath={"reassoc", "contract"})


@kernel
def observe(start, stop, values, groups, centre, y, square, n_runs, runs, found):
    """Deviations y (P, stop - start, m) from `centre` (G, P, m), 0 where missing; append gaps to `runs` at `found`."""
    _, p, m = values.shape
    opened = np.full(m, -1)
    for k in range(start, stop):
        before = found
        for j in range(p):
            for a in range(m):
                x = values[k, j, a] - centre[groups[k], j, a]
                missing = x != x
                x = 0.0 if missing else x
                y[j, k - start, a] = x
                square[k, a] += x * x
                if missing != (opened[a] >= 0):
                    if missing:
                        opened[a] = j * m + a
                    else:
                        runs[found, 0], runs[found, 1] = opened[a], j * m + a
                        opened[a], found = -1, found + 1
        for a in range(m):
            if opened[a] >= 0:
                runs[found, 0], runs[found, 1] = opened[a], p * m + a
                opened[a], found = -1, found + 1
        n_runs[k] = found - before
    return found


@kernel
def summarise(values, seen, ends, means, steps):
    """Counts `seen` (P, m), lows and highs `ends` (2, m), `means` and largest `steps` (K, m) of cycles (K, P, m)."""
    cycles, p, m = values.shape
    counts = np.empty(m)
    for k in range(cycles):
        counts[:] = 0
        for j in range(p):
            for a in range(m):
                x = values[k, j, a]
                if x == x:
                    seen[j, a] += 1
                    counts[a] += 1
                    means[k, a] += x
                    ends[0, a], ends[1, a] = min(ends[0, a], x), max(ends[1, a], x)
                    if j:
                        step = abs(x - values[k, j - 1, a])
                        if step > steps[k, a]:  # never beside a gap
                            steps[k, a] = step
        means[k] /= np.maximum(counts, 1)


@sums
def project(rows, y, out):
    """Products out (n, c) of a few basis functions `rows` (n, P) with y (P, c), four by four samples at a time.

    BLAS would start threads within our threads, and they would wait for each other.
    """
    many, whole = len(rows) // 4 * 4, y.shape[0] // 4 * 4
    out[:] = 0.0
    for h in range(0, many, 4):
        b0, b1, b2, b3 = rows[h], rows[h + 1], rows[h + 2], rows[h + 3]
        for j in range(0, whole, 4):
            for c in range(y.shape[1]):
                y0, y1, y2, y3 = y[j, c], y[j + 1, c], y[j + 2, c], y[j + 3, c]
                out[h, c] += b0[j] * y0 + b0[j + 1] * y1 + b0[j + 2] * y2 + b0[j + 3] * y3
                out[h + 1, c] += b1[j] * y0 + b1[j + 1] * y1 + b1[j + 2] * y2 + b1[j + 3] * y3
                out[h + 2, c] += b2[j] * y0 + b2[j + 1] * y1 + b2[j + 2] * y2 + b2[j + 3] * y3
                out[h + 3, c] += b3[j] * y0 + b3[j + 1] * y1 + b3[j + 2] * y2 + b3[j + 3] * y3
    for h in range(len(rows)):
        for j in range(whole if h < many else 0, y.shape[0]):
            for c in range(y.shape[1]):
                out[h, c] += rows[h, j] * y[j, c]


@sums
def gap_sums(offsets, runs, table, out):
    """Sums (K, c) over the gaps of each cycle, from cumulative sums `table`."""
    for k in range(len(out)):
        for e in range(offsets[k], offsets[k + 1]):
            for i in range(table.shape[1]):
                out[k, i] += table[runs[e, 1], i] - table[runs[e, 0], i]


@sums
def group_sums(rows, groups, out):
    """Sums (G, c) of `rows` (K, c) by group."""
    for k in range(len(rows)):
        for i in range(rows.shape[1]):
            out[groups[k], i] += rows[k, i]


@sums
def _project(coefficients, loadings, out):
    """Products of one cycle's coefficients (N,) with the loadings (q, N)."""
    for i in range(len(loadings)):
        total = 0.0
        for d in range(len(coefficients)):
            total += loadings[i, d] * coefficients[d]
        out[i] = total


@sums
def _tally(coefficients, z, second, runs, yz, zz_edges):
    """Add a cycle's y zᵀ to yz (q, N), and its E[z zᵀ] at the edges of its gaps."""
    for i in range(len(z)):
        for d in range(len(coefficients)):
            yz[i, d] += z[i] * coefficients[d]
    for e in range(len(runs)):
        for i in range(len(second)):
            zz_edges[runs[e, 0], i] += second[i]
            zz_edges[runs[e, 1], i] -= second[i]


@sums
def _cholesky(lower, root):
    """Lower root (q, q) of the symmetric matrix of lower triangle `lower`; returns log det."""
    log_det = 0.0
    for i in range(len(root)):
        for j in range(i + 1):
            total = lower[i * (i + 1) // 2 + j]
            for h in range(j):
                total -= root[i, h] * root[j, h]
            root[i, j] = total / root[j, j] if j < i else np.sqrt(total)
        log_det += 2 * np.log(root[i, i])
    return log_det


@sums
def _invert(root, inverse):
    """Inverse of a lower triangular matrix, into the lower triangle of `inverse`."""
    for j in range(len(root)):
        inverse[j, j] = 1 / root[j, j]
        for i in range(j + 1, len(root)):
            total = 0.0
            for h in range(j, i):
                total -= root[i, h] * inverse[h, j]
            inverse[i, j] = total / root[i, i]


@sums
def _moments(inverse, right, z, covariance, second):
    """Mean and covariance of N(A⁻¹ right, A⁻¹), given the inverse of A's root; lower triangle of E[z zᵀ]."""
    q = len(right)
    z[:] = 0.0
    for i in range(q):
        for j in range(q):
            total = 0.0
            for h in range(max(i, j), q):
                total += inverse[h, i] * inverse[h, j]
            covariance[i, j] = total
            z[i] += total * right[j]
    for i in range(q):
        for j in range(i + 1):
            second[i * (i + 1) // 2 + j] = covariance[i, j] + z[i] * z[j]


@sums
def _leave_out(gaps, outer, cross, lower, right):
    """Subtract the missing samples from the sums over all samples: `outer` from lower, `cross` from right."""
    for e in range(len(gaps)):
        first, last = gaps[e, 0], gaps[e, 1]
        for i in range(len(lower)):
            lower[i] += outer[first, i] - outer[last, i]
        for i in range(len(right)):
            right[i] += cross[last, i] - cross[first, i]


@sums
def posterior(start, stop, data, tables, found, tallies):
    """Posterior of the latents of cycles `start` to `stop`, and the sums that the M step needs.

    `data`: coefficients (K, N), groups, offsets, runs. `tables`: loadings W / σ² (q, N), means / σ² (G, N), cumulative
    sums of W Wᵀ / σ² ((P + 1)·m, q(q + 1)/2), the same over all samples, cumulative sums of W mean / σ² and of mean² /
    σ² + log 2πσ² (G, (P + 1)·m, q + 1), the same over all samples. `found`, output: z (K, q), covariances (K, q, q),
    twice the log-likelihood without -y² / σ² (K,). `tallies`, accumulated: Σ z yᵀ (q, N), and at the edges of the gaps
    Σ E[z zᵀ] and Σ E[z].
    """
    coefficients, groups, offsets, runs = data
    loadings, means, outer, all_outer, cross, all_cross = tables
    zs, covariances, twice = found
    yz, zz_edges, z_edges = tallies
    q = len(loadings)
    lower, right, second, on_mean = np.empty(len(all_outer)), np.empty(q + 1), np.empty(len(all_outer)), np.empty(1)
    root, inverse = np.zeros((q, q)), np.zeros((q, q))
    for k in range(start, stop):
        g, y, gaps, z = groups[k], coefficients[k], runs[offsets[k] : offsets[k + 1]], zs[k]
        lower[:], right[:] = all_outer, -all_cross[g]
        _leave_out(gaps, outer, cross[g], lower, right)
        for i in range(q):
            lower[i * (i + 3) // 2] += 1.0  # the prior
        _project(y, loadings, second)
        _project(y, means[g : g + 1], on_mean)
        right[:q] += second[:q]
        twice[k] = right[q] + 2 * on_mean[0] - _cholesky(lower, root)
        _invert(root, inverse)
        _moments(inverse, right[:q], z, covariances[k], second)
        for i in range(q):
            twice[k] += right[i] * z[i]
        _tally(y, z, second, gaps, yz, zz_edges)
        for e in range(len(gaps)):
            z_edges[g, gaps[e, 0]] += z
            z_edges[g, gaps[e, 1]] -= z


@sums
def impute_scores(start, stop, data, tables, found, tallies, repeats):
    """Fig. 8's step from X⁽²⁾ to scores with fixed components, `repeats` times: z = Wᵀ x, gaps of x filled by W z.

    For cycles `start` to `stop`. `data`: coefficients (K, N), groups (not used), offsets, runs. `tables`: orthonormal
    loadings (q, N), cumulative sums of W Wᵀ ((P + 1)·m, q(q + 1)/2). `found`: z (K, q), read for the first filling of
    gaps and overwritten; output (K,): squared errors on the seen samples, less y². `tallies`, accumulated: Σ z yᵀ (q,
    N), and at the edges of the gaps Σ z zᵀ.
    """
    coefficients, _, offsets, runs = data
    loadings, outer = tables
    zs, squares = found
    yz, zz_edges = tallies
    q = len(loadings)
    lower, right, filled = np.empty(outer.shape[1]), np.empty(q), np.empty(q)
    nothing = np.empty((0, 0))
    for k in range(start, stop):
        y, gaps, z = coefficients[k], runs[offsets[k] : offsets[k + 1]], zs[k]
        _project(y, loadings, right)
        lower[:] = 0.0
        _leave_out(gaps, outer, nothing, lower, right[:0])
        lower[:] = -lower
        _multiply(lower, z, filled)
        for _ in range(repeats):
            z[:] = right + filled
            _multiply(lower, z, filled)
        squares[k] = 0.0
        for i in range(q):
            squares[k] += z[i] * (z[i] - filled[i] - 2 * right[i])
            for j in range(i + 1):
                lower[i * (i + 1) // 2 + j] = z[i] * z[j]
        _tally(y, z, lower, gaps, yz, zz_edges)


@sums
def _multiply(lower, z, out):
    """Product of the symmetric matrix of lower triangle `lower` with z (q,)."""
    for i in range(len(z)):
        total = 0.0
        for j in range(len(z)):
            total += lower[i * (i + 1) // 2 + j if j <= i else j * (j + 1) // 2 + i] * z[j]
        out[i] = total
