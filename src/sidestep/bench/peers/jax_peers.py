"""The peers that are written in JAX: the thesis's equations by automatic differentiation, and CBFpy's filter."""

from __future__ import annotations

import importlib
import importlib.util
import os
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.bench.peers.serial_chain import SerialChain, cross_matrix

Array = npt.NDArray[np.float64]

# What CBFpy's documentation recommends on a CPU; has to be set before JAX is first imported.
ENVIRONMENT = {
    "JAX_ENABLE_X64": "True",
    "JAX_PLATFORMS": "cpu",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
    "OPENBLAS_NUM_THREADS": "1",
}


def available(module: str) -> bool:
    """Whether a module is installed."""
    return importlib.util.find_spec(module) is not None


def imported(module: str) -> Any:
    """A module, with JAX on one thread of the CPU in double precision."""
    os.environ.update(ENVIRONMENT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module(module)


def poses(chain: SerialChain) -> Callable[[Any], list[tuple[Any, Any]]]:
    """Forward kinematics in JAX: rotation and origin of every joint in the world."""
    jnp = imported("jax.numpy")
    crosses = [jnp.asarray(cross_matrix(axis)) for axis in chain.axes]

    def at(q: Any) -> list[tuple[Any, Any]]:
        R, x, found = jnp.eye(3), jnp.zeros(3), []
        for i, S in enumerate(crosses):
            turn = jnp.eye(3) + jnp.sin(q[i]) * S + (1.0 - jnp.cos(q[i])) * S @ S
            x = x + R @ jnp.asarray(chain.translations[i])
            R = R @ jnp.asarray(chain.rotations[i]) @ turn
            found.append((R, x))
        return found

    return at


def geodesic_system(
    chain: SerialChain, point: Array, goal: Array, *, stiffness: float, damping: float
) -> Callable[[Array, Array], Array]:
    """q'' = -G^-1 K (q - q*) - D v - G^-1 dpsi psi'' (T5.4), psi written down and the rest differentiated, compiled."""
    jax, jnp = imported("jax"), imported("jax.numpy")
    forward = poses(chain)
    inverses = [jnp.asarray(np.linalg.inv(S)) for S in chain.covariances]
    scales = chain.weights / np.sqrt((2.0 * np.pi) ** 3 * np.linalg.det(chain.covariances))

    def psi(q: Any) -> Any:
        frames, total = forward(q), 0.0
        for k, owner in enumerate(chain.owners):
            R, x = frames[owner]
            e = R.T @ (jnp.asarray(point) - x) - jnp.asarray(chain.means[k])
            total = total + scales[k] * jnp.exp(-0.5 * e @ inverses[k] @ e)
        return total

    def acceleration(q: Any, v: Any) -> Any:
        slope, turned = jax.jvp(jax.grad(psi), (q,), (v,))
        force = stiffness * (q - jnp.asarray(goal)) + slope * (turned @ v)
        return -(force - slope * (slope @ force) / (1.0 + slope @ slope)) - damping * v

    compiled = jax.jit(acceleration)
    return lambda q, v: np.asarray(compiled(q, v))


def barrier_filter(
    chain: SerialChain, centres: Array, radii: Array, owners: list[int], balls: Array
) -> Callable[[Array, Array], Array]:
    """CBFpy: the joint velocity nearest to a wanted one that lets no body sphere come nearer to a ball than it may.

    Args:
        chain: the arm. centres, radii, owners: of the body's spheres, (K, 3), (K,) [m], the joint that carries each.
        balls: (N, 4) [m] centre and radius.
    """
    jnp, cbfpy = imported("jax.numpy"), imported("cbfpy")
    forward = poses(chain)
    by_joint = {joint: np.flatnonzero(np.array(owners) == joint) for joint in sorted(set(owners))}
    num = chain.num_joints

    class Spheres(cbfpy.CBFConfig):  # type: ignore[misc, name-defined]
        def __init__(self) -> None:
            backend = {"backend": "elastiqp"} if available("elastiqp") else {}
            super().__init__(n=num, m=num, **backend)

        def f(self, z: Any) -> Any:
            return jnp.zeros(num)

        def g(self, z: Any) -> Any:
            return jnp.eye(num)

        def h_1(self, z: Any) -> Any:
            frames, found = forward(z), []
            for joint, k in by_joint.items():
                R, x = frames[joint]
                away = (x + jnp.asarray(centres[k]) @ R.T)[:, None, :] - jnp.asarray(balls[:, :3])
                gaps = (
                    jnp.linalg.norm(away, axis=2) - jnp.asarray(balls[:, 3]) - jnp.asarray(radii[k])[:, None]
                )
                found.append(gaps.min(axis=1))
            return jnp.concatenate(found)

        def alpha(self, h: Any) -> Any:
            return 5.0 * h

    filtered = cbfpy.CBF.from_config(Spheres()).safety_filter
    return lambda q, v: np.asarray(filtered(q, v))
