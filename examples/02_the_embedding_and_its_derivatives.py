"""The embedding and its derivatives.

An embedding adds coordinates psi(q) to the joint space: large where the body is at an obstacle. Everything
that follows needs only its value, its Jacobian and its second time derivative along the motion. Here each
is compared with finite differences, and the geodesic term in closed form with dense Christoffel symbols.
"""

import numpy as np

import sidestep as ss
from sidestep import thesis

robot = ss.Robot.named("planar3")
body = ss.Body.fit(robot, components=2, seed=0)
obstacles = ss.Obstacles([[0.9, 0.3, 0.0], [0.4, -0.5, 0.0]], radii=0.1)
psi = thesis.CollisionDensity(robot, body)

q, v = np.array([0.3, -0.4, 0.8]), np.array([0.5, -1.0, 0.7])
here = psi.evaluate(q, v, obstacles)
print("psi", here.values, " gradient", here.jacobian[0], " d2psi/dt2", here.curvatures)

# Fourth-order differences; the step balances truncation (h^4) and rounding (eps/h^2).
h = 1e-3
along = [psi.evaluate(q + k * h * v, v, obstacles).values[0] for k in (-2, -1, 0, 1, 2)]
slope = np.dot([1, -8, 0, 8, -1], along) / (12 * h)
curvature = np.dot([-1, 16, -30, 16, -1], along) / (12 * h * h)
print(f"relative error of dpsi/dt:   {abs(slope / (here.jacobian[0] @ v) - 1):.1e}")
print(f"relative error of d2psi/dt2: {abs(curvature / here.curvatures[0] - 1):.1e}")

closed = thesis.geodesic_acceleration(here.jacobian, here.curvatures)
symbols = thesis.christoffel_symbols(here.jacobian, psi.hessian(q, obstacles)[None])
dense = -np.einsum("kij,i,j->k", symbols, v, v)
print("geodesic acceleration", closed)
print(f"relative difference to dense Christoffel symbols: {np.abs(closed / dense - 1).max():.1e}")
