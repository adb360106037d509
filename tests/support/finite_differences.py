"""Central differences of fourth order: truncation h^4, so that a step of 1e-4 reaches 1e-9 and better."""

from collections.abc import Callable

import numpy as np


def derivative(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: float = 1e-4
) -> np.ndarray:
    """d function / d at, the index of `at` last."""
    columns = []
    for direction in np.eye(at.size):
        near = function(at + step * direction) - function(at - step * direction)
        far = function(at + 2 * step * direction) - function(at - 2 * step * direction)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=-1)


def second_derivative(function: Callable[[float], float], step: float) -> float:
    """d2 function / dt2 at t = 0."""
    near = function(step) + function(-step)
    far = function(2 * step) + function(-2 * step)
    return (16 * near - far - 30 * function(0.0)) / (12 * step**2)
