"""Small matrices by plain sums: the same bits on every processor, which BLAS and LAPACK do not give."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# Off-diagonal entry, relative to the geometric mean of its two diagonal entries, that counts as none: above rounding.
# Without it rounding would choose the axes of what is round or square.
_ROUND = 1e-9
_SWEEPS = 30  # of Jacobi's method; 3 x 3 matrices take at most 6


def product(a: Array, b: Array) -> Array:
    """The matrix products (..., n, m) of a (..., n, k) and b (..., k, m)."""
    total = a[..., :, 0, None] * b[..., None, 0, :]
    for k in range(1, a.shape[-1]):
        total = total + a[..., :, k, None] * b[..., None, k, :]
    return np.asarray(total)


def transformed(points: Array, X: Array) -> Array:
    """Points (N, 3) after a transform X (4, 4)."""
    return product(points, X[:3, :3].T) + X[:3, 3]


def determinant(m: Array) -> Array:
    """The determinants (...) of matrices (..., 3, 3)."""
    return np.asarray((m[..., 0, :] * _cofactors(m)[..., 0, :]).sum(axis=-1))


def inverse(m: Array) -> Array:
    """The inverses of matrices (..., 3, 3)."""
    cofactors = _cofactors(m)
    determinants = (m[..., 0, :] * cofactors[..., 0, :]).sum(axis=-1)
    return np.asarray(np.swapaxes(cofactors, -1, -2) / determinants[..., None, None])


def _cofactors(m: Array) -> Array:
    a, b, c = m[..., 0, :], m[..., 1, :], m[..., 2, :]
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)


def principal_axes(symmetric: Array) -> tuple[Array, Array]:
    """Eigenvalues (3,) and eigenvectors (3, 3), in columns, of a symmetric matrix (3, 3); ascending but for rounding.

    By Jacobi's rotations (Golub, Van Loan, Matrix Computations, 8.5). Where eigenvalues are equal but for rounding the
    axes are those that the coordinate axes turn into, not ones that rounding chooses.
    """
    a = [[float(symmetric[i, j]) for j in range(3)] for i in range(3)]
    v = [[float(i == j) for j in range(3)] for i in range(3)]
    for _ in range(_SWEEPS):
        turned = False
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if abs(a[p][q]) <= _ROUND * math.sqrt(abs(a[p][p] * a[q][q])):
                continue
            turned = True
            theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q]
            t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
            c = 1.0 / math.sqrt(t * t + 1.0)
            s = t * c
            for k in range(3):
                a[k][p], a[k][q] = c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]
            for k in range(3):
                a[p][k], a[q][k] = c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]
            for k in range(3):
                v[k][p], v[k][q] = c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]
        if not turned:
            break
    order = [0, 1, 2]
    for i in (0, 1, 0):  # equal ones stay in the order of the coordinate axes
        one, next_one = a[order[i]][order[i]], a[order[i + 1]][order[i + 1]]
        if one > next_one + _ROUND * abs(next_one):
            order[i], order[i + 1] = order[i + 1], order[i]
    return np.array([a[k][k] for k in order]), np.array([[row[k] for k in order] for row in v])
