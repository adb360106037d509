"""The derivatives as chapter 4 of the thesis lays them out, corrected: dense tensors, term by term, in NumPy.

This is what the thesis times, and a second, independent way to the gradient and Hessian of the core.
Corrections: rotations multiply from base to tip with the fixed placements between them (T3.8, T4.6, T4.16),
the determinant has a derivative (T4.10, T4.14), and the mixed term of T4.17 is symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.bench.peers.serial_chain import SerialChain, cross_matrix
from sidestep.bench.peers.way import Array


@dataclass(frozen=True, eq=False)
class Derivatives:
    """ψ, its gradient (d,) and its Hessian (d, d)."""

    value: float
    gradient: Array
    hessian: Array


@dataclass(frozen=True, eq=False)
class LinkTensors:
    """Rotation (3, 3) and origin (3,) of a link with first (d, …) and second (d, d, …) derivatives by q."""

    R: Array
    dR: Array
    ddR: Array
    x: Array
    dx: Array
    ddx: Array


def link_tensors(chain: SerialChain, q: Array) -> list[LinkTensors]:
    """Tensors of every joint's child (T4.5, T4.6, T4.15, T4.16)."""
    d = chain.num_joints
    R, dR, ddR = np.eye(3), np.zeros((d, 3, 3)), np.zeros((d, d, 3, 3))
    x, dx, ddx = np.zeros(3), np.zeros((d, 3)), np.zeros((d, d, 3))
    links = []
    for i in range(d):
        x = x + R @ chain.translations[i]
        dx = dx + dR @ chain.translations[i]
        ddx = ddx + ddR @ chain.translations[i]
        S = cross_matrix(chain.axes[i])
        turn = np.eye(3) + np.sin(q[i]) * S + (1.0 - np.cos(q[i])) * S @ S
        step = chain.rotations[i] @ turn
        stepped = chain.rotations[i] @ S @ turn
        ddR = ddR @ step
        mixed = dR @ stepped
        ddR[i] += mixed
        ddR[:, i] += mixed
        ddR[i, i] = R @ chain.rotations[i] @ S @ S @ turn
        dR = dR @ step
        dR[i] = R @ stepped
        R = R @ step
        links.append(LinkTensors(R, dR, ddR, x, dx, ddx))
    return links


def psi(chain: SerialChain, q: Array, point: Array) -> Derivatives:
    """ψ at a point (3,) [m] with gradient (T4.3) and Hessian (T4.12)."""
    d = chain.num_joints
    value, gradient, hessian = 0.0, np.zeros(d), np.zeros((d, d))
    links = link_tensors(chain, q)
    for k, owner in enumerate(chain.owners):
        link, S0 = links[owner], chain.covariances[k]
        mean = link.R @ chain.means[k] + link.x
        dmean = link.dR @ chain.means[k] + link.dx
        ddmean = link.ddR @ chain.means[k] + link.ddx
        S = link.R @ S0 @ link.R.T
        half = link.dR @ S0 @ link.R.T
        dS = half + half.transpose(0, 2, 1)
        outer = link.ddR @ S0 @ link.R.T
        mixed = (link.dR @ S0)[:, None] @ link.dR.transpose(0, 2, 1)[None]
        ddS = outer + outer.transpose(0, 1, 3, 2) + mixed + mixed.transpose(1, 0, 2, 3)
        L = np.linalg.inv(S)
        e = point - mean
        w = L @ e
        N = chain.weights[k] * np.exp(-0.5 * e @ w) / np.sqrt((2.0 * np.pi) ** 3 * np.linalg.det(S))
        by_mean = N * w  # T4.9
        shape = 0.5 * (np.outer(w, w) - L)
        by_covariance = N * shape  # T4.10 with the determinant's term
        slope = dmean @ by_mean + np.einsum("jab,ab->j", dS, by_covariance)
        dL = -L @ dS @ L
        dw = dL @ e - dmean @ L
        dby_mean = slope[:, None] * w + N * dw  # T4.13
        product = dw[:, :, None] * w[None, None, :]
        dby_covariance = slope[:, None, None] * shape + 0.5 * N * (product + product.transpose(0, 2, 1) - dL)
        hessian += (
            dby_mean @ dmean.T
            + ddmean @ by_mean
            + np.einsum("jab,kab->jk", dby_covariance, dS)
            + np.einsum("jkab,ab->jk", ddS, by_covariance)
        )
        gradient += slope
        value += float(N)
    return Derivatives(value, gradient, hessian)


def acceleration(
    chain: SerialChain,
    q: Array,
    v: Array,
    goal: Array,
    point: Array,
    *,
    stiffness: float = 0.5,
    damping: float = 1.5,
) -> Array:
    """q'' = -G⁻¹ K (q - q*) - D v - Ξ v with dense Christoffel symbols (T2.7, T4.11, T5.4)."""
    found = psi(chain, q, point)
    metric = np.eye(len(q)) + np.outer(found.gradient, found.gradient)
    # dG[l, i, j] = ∂g_ij / ∂q_l  (T4.11)
    product = found.hessian[:, :, None] * found.gradient[None, None, :]
    return from_metric(
        metric, product + product.transpose(0, 2, 1), q, v, goal, stiffness=stiffness, damping=damping
    )


def from_metric(
    metric: Array, dmetric: Array, q: Array, v: Array, goal: Array, *, stiffness: float, damping: float
) -> Array:
    """The acceleration of T5.4 from the metric (d, d) and its derivative [l, i, j] = ∂g_ij/∂q_l."""
    # first kind, [l, i, j] = ½ (∂_j g_il + ∂_i g_jl - ∂_l g_ij)
    first = 0.5 * (dmetric.transpose(2, 1, 0) + dmetric.transpose(2, 0, 1) - dmetric)
    inverse = np.linalg.inv(metric)
    second = np.tensordot(inverse, first, axes=1)
    result: Array = -inverse @ (stiffness * (q - goal)) - damping * v - (second @ v) @ v
    return result
