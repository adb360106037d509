"""Physics of a robot among objects, one control period at a time: what every loop around MuJoCo shares."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from sidestep.distance.scene import SceneObject
from sidestep.simulation.model import SimulationModel
from sidestep.simulation.run import Contact

Array = npt.NDArray[np.float64]


class Physics:
    """One robot among objects in MuJoCo: `measure`, then `advance`, once a control period.

    Args:
        built: the model, at the timestep of the physics. objects: its scene.
        period: control period [s]. substeps: physics steps in it; the torque is held over them.
    """

    def __init__(
        self, built: SimulationModel, objects: tuple[SceneObject, ...], *, period: float, substeps: int = 1
    ) -> None:
        self.built = built
        self.data = mujoco.MjData(built.model)
        self._period, self._substeps = period, substeps
        ids = built.model.body_mocapid[list(built.object_bodies)]
        self._moving = [
            (item, mocap) for item, mocap in zip(objects, ids, strict=True) if item.motion == "moving"
        ]
        self._diverged = self.data.warning[mujoco.mjtWarning.mjWARN_BADQACC]
        self._at_rest = all(item.motion == "fixed" for item in objects)
        self._poses = np.zeros((len(objects), 7))

    def begin(self, q: Array, v: Array) -> None:
        """Puts the robot at q, v (nv,)."""
        self.built.set_state(self.data, q, v)
        mujoco.mj_kinematics(self.built.model, self.data)
        self._poses = self.built.object_poses(self.data)

    def measure(self, time: float) -> tuple[Array, Array]:
        """Puts driven objects where they are at `time` [s]; q and v (nv,) of the robot."""
        self._drive(time)
        mujoco.mj_step1(self.built.model, self.data)
        return self.built.state(self.data)

    def object_poses(self) -> Array:
        """Position and quaternion (w, x, y, z) in the world of each object, (N, 7), after `measure`."""
        if not self._at_rest:
            self._poses = self.built.object_poses(self.data)
        return self._poses

    def advance(self, torque: Array, time: float) -> tuple[Array, list[Contact]]:
        """Holds a torque (nv,) [Nm | N] over the period that begins at `time` [s].

        Returns:
            v (nv,) after it, and the contact points between arm and scene of every physics step.

        Raises:
            RuntimeError: the physics diverged (MuJoCo's own check).
        """
        built, data = self.built, self.data
        data.ctrl[built.actuators] = torque
        contacts: list[Contact] = []
        for substep in range(self._substeps):
            if substep > 0:
                self._drive(time + substep * self._period / self._substeps)
                mujoco.mj_step1(built.model, data)
            mujoco.mj_step2(built.model, data)
            if data.ncon:
                contacts.extend(self._contacts(time))
        _, v = built.state(data)
        if self._diverged.number or not np.isfinite(v).all():
            raise RuntimeError(f"the physics diverged at {time:.3f} s; shorten the timestep or add substeps")
        return v, contacts

    def _drive(self, time: float) -> None:
        """Puts the moving objects where their script says."""
        for item, mocap in self._moving:
            self.data.mocap_pos[mocap] = item.pose_at(time)[:3, 3]

    def _contacts(self, time: float) -> list[Contact]:
        found = []
        wrench = np.zeros(6)
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            owners = [self.built.geom_owner[int(g)] for g in contact.geom]
            links = [name for role, name in owners if role == "link"]
            if not links or contact.dist > 0.0:
                continue
            obstacle = next(name for role, name in owners if role != "link")
            mujoco.mj_contactForce(self.built.model, self.data, index, wrench)
            found.append(Contact(time, links[0], obstacle, float(-contact.dist), float(wrench[0])))
        return found
