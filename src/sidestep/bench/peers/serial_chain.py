"""A serial arm with one body, as plain arrays: what the dense and the autograd versions of chapter 4 read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep._core import Body, JointType, Robot
from sidestep.bench.peers.way import Array


@dataclass(frozen=True, eq=False)
class SerialChain:
    """Joints from base to tip, and the Gaussians that they move.

    Attributes:
        rotations, translations: placement of joint i on joint i - 1, (d, 3, 3) and (d, 3) [m].
        axes: unit vectors in the joint frames, (d, 3).
        owners: joint that carries each Gaussian, (K,).
        weights, means, covariances: (K,), (K, 3) [m], (K, 3, 3) [m²], in the frames of those joints.
    """

    rotations: Array
    translations: Array
    axes: Array
    owners: tuple[int, ...]
    weights: Array
    means: Array
    covariances: Array

    @property
    def num_joints(self) -> int:
        """Number of joints d."""
        return len(self.axes)

    @classmethod
    def of(cls, robot: Robot, body: Body) -> SerialChain:
        """The chain of a robot.

        Raises:
            ValueError: a robot that branches, or a joint that is not a plain revolute one.
        """
        for index, joint in enumerate(robot.joints):
            plain = joint.multiplier == 1.0 and joint.offset == 0.0 and joint.coordinate == index
            if joint.type != JointType.revolute or joint.parent != index - 1 or not plain:
                raise ValueError(
                    f"joint {joint.name!r} of robot {robot.name!r} is not the next plain revolute joint; "
                    "chapter 4 of the thesis covers serial revolute arms only"
                )
        frames = {frame.name: frame for frame in robot.frames}
        moved = [k for k, link in enumerate(body.links) if frames[link].joint >= 0]
        placements = [frames[body.links[k]].placement for k in moved]
        return cls(
            rotations=np.array([joint.placement[:3, :3] for joint in robot.joints]),
            translations=np.array([joint.placement[:3, 3] for joint in robot.joints]),
            axes=np.array([joint.axis for joint in robot.joints]),
            owners=tuple(frames[body.links[k]].joint for k in moved),
            weights=body.weights[moved],
            means=np.array(
                [X[:3, :3] @ body.means[k] + X[:3, 3] for k, X in zip(moved, placements, strict=True)]
            ),
            covariances=np.array(
                [
                    X[:3, :3] @ body.covariances[k] @ X[:3, :3].T
                    for k, X in zip(moved, placements, strict=True)
                ]
            ),
        )


def cross_matrix(vector: Array) -> Array:
    """S(w) (3, 3) with S(w) x = w × x."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
