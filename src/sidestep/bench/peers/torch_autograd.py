"""The same by automatic differentiation, as the thesis's other row: ψ written down, the rest from torch.autograd."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

import numpy as np

from sidestep.bench.peers.dense_analytic import from_metric
from sidestep.bench.peers.serial_chain import SerialChain, cross_matrix
from sidestep.bench.peers.way import Array


def available() -> bool:
    """Whether PyTorch is installed; nothing else in the package uses it."""
    return importlib.util.find_spec("torch") is not None


class AutogradSystem:
    """T5.4 with the metric and its derivative from torch.autograd, in double precision on one thread.

    Args:
        chain: the arm and its body.
        point: the obstacle (3,) [m].

    Raises:
        ModuleNotFoundError: PyTorch is not installed.
    """

    def __init__(self, chain: SerialChain, point: Array) -> None:
        torch: Any = importlib.import_module("torch")
        torch.set_num_threads(1)
        self._torch = torch
        self._chain = chain
        make = torch.from_numpy
        self._rotations = make(np.ascontiguousarray(chain.rotations))
        self._translations = make(np.ascontiguousarray(chain.translations))
        self._crosses = make(np.array([cross_matrix(axis) for axis in chain.axes]))
        self._means = make(np.ascontiguousarray(chain.means))
        self._covariances = make(np.ascontiguousarray(chain.covariances))
        self._point = make(np.ascontiguousarray(point, dtype=np.float64))

    def psi(self, q: Any) -> Any:
        """ψ of a tensor q (d,), with covariances that rotate as T3.7 writes it."""
        torch = self._torch
        R, x = torch.eye(3, dtype=torch.float64), torch.zeros(3, dtype=torch.float64)
        poses = []
        for i in range(self._chain.num_joints):
            S = self._crosses[i]
            turn = torch.eye(3, dtype=torch.float64) + torch.sin(q[i]) * S + (1.0 - torch.cos(q[i])) * S @ S
            x = x + R @ self._translations[i]
            R = R @ self._rotations[i] @ turn
            poses.append((R, x))
        total = torch.zeros((), dtype=torch.float64)
        for k, owner in enumerate(self._chain.owners):
            R, x = poses[owner]
            covariance = R @ self._covariances[k] @ R.T
            offset = self._point - (x + R @ self._means[k])
            exponent = -0.5 * offset @ torch.linalg.inv(covariance) @ offset
            scale = torch.sqrt((2.0 * np.pi) ** 3 * torch.linalg.det(covariance))
            total = total + float(self._chain.weights[k]) * torch.exp(exponent) / scale
        return total

    def _gradient(self, q: Any) -> Any:
        return self._torch.autograd.grad(self.psi(q), q, create_graph=True)[0]

    def _metric(self, q: Any) -> Any:
        slope = self._gradient(q)
        return self._torch.eye(len(q), dtype=self._torch.float64) + self._torch.outer(slope, slope)

    def derivatives(self, q: Array) -> tuple[float, Array, Array]:
        """ψ, gradient (d,) and Hessian (d, d)."""
        at = self._torch.tensor(q, dtype=self._torch.float64, requires_grad=True)
        hessian = self._torch.autograd.functional.jacobian(self._gradient, at)
        return float(self.psi(at).detach()), self._gradient(at).detach().numpy(), hessian.numpy()

    def acceleration(
        self, q: Array, v: Array, goal: Array, *, stiffness: float = 0.5, damping: float = 1.5
    ) -> Array:
        """T5.4; the derivative of every entry of the metric is one backward pass."""
        at = self._torch.tensor(q, dtype=self._torch.float64, requires_grad=True)
        metric = self._metric(at).detach().numpy()
        by_q = self._torch.autograd.functional.jacobian(self._metric, at).numpy()  # [i, j, l]
        return from_metric(metric, by_q.transpose(2, 0, 1), q, v, goal, stiffness=stiffness, damping=damping)
