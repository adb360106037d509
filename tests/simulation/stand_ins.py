"""Plain systems and controllers whose behaviour is known in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from sidestep.simulation import Simulation, SimulationRun
from sidestep.thesis.adapter import SystemAdapter

PENDULUM = """
<robot name="pendulum">
  <link name="base"/>
  <joint name="pivot" type="revolute">
    <parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" velocity="10" effort="50"/>
  </joint>
  <link name="bob">
    <inertial>
      <origin xyz="0 0 -0.4"/><mass value="1.5"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.015"/>
    </inertial>
    <collision><origin xyz="0 0 -0.4"/><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
</robot>
"""


class Spring:
    """a = -k (q - goal) - d v."""

    def __init__(self, stiffness: float = 2.0, damping: float = 3.0) -> None:
        self.stiffness, self.damping = stiffness, damping
        self.seen: list[np.ndarray] = []

    def acceleration(self, q, v, goal, obstacles):
        self.seen.append(obstacles.points)
        a = -self.stiffness * (q - goal) - self.damping * v
        return SimpleNamespace(acceleration=a, status="ok", switch=np.ones(1), values=np.zeros(1))


class InverseDynamics:
    """torque = M a + h, without limits."""

    def solve(self, q, v, acceleration, mass_matrix, bias):
        return SimpleNamespace(
            torque=mass_matrix @ acceleration + bias, acceleration=acceleration, status="ok"
        )


class Holding:
    """torque = h (gravity compensation) or 0 (free swing); wants no acceleration."""

    def __init__(self, *, compensate: bool) -> None:
        self.compensate = compensate

    def solve(self, q, v, acceleration, mass_matrix, bias):
        return SimpleNamespace(torque=self.compensate * bias, acceleration=acceleration, status="ok")


def simulate(
    simulation: Simulation, system, program, start, goal, duration, obstacles, **options
) -> SimulationRun:
    """A run driven by a system and a program."""
    return simulation.run(SystemAdapter(system, goal, obstacles, program), start, goal, duration, **options)
