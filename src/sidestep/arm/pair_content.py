"""What the clearance of two links depends on, as a hash: equal pairs of different arms share what is measured."""

from __future__ import annotations

import hashlib
from functools import cached_property

import numpy as np

from sidestep._core import Joint
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.robot.fingerprint import surface_hash

DECIMALS = 9  # lengths [m] and angles are hashed to 1e-9, as in the fingerprint of a robot


class PairContent:
    """The hashes of pairs of links of a robot: the joints between them, their limits, both surfaces and both covers.

    Args:
        robot: with collision meshes. body: whose ellipsoids count too; none where the surfaces alone do.
    """

    def __init__(self, robot: Robot, body: Body | None = None) -> None:
        self._robot, self._body = robot, body
        self._frames = {frame.name: frame for frame in robot.frames}
        self._base = np.linalg.inv(robot.frames[0].placement)  # a robot that stands elsewhere has equal pairs
        self._links: dict[str, str] = {}

    def key(self, first: str, second: str, *settings: object) -> str:
        """Hash (64 hex digits) of a pair and of the settings that it is measured by."""
        digest = hashlib.sha256()
        above = {link: self._above(link) for link in (first, second)}
        for link, partner in ((first, second), (second, first)):
            digest.update(self._link(link).encode())
            for index in above[link]:
                if index not in above[partner]:
                    digest.update(self._joint(index).encode())
        digest.update(repr(settings).encode())
        return digest.hexdigest()

    def _above(self, link: str) -> list[int]:
        """The joints from a link down to the base."""
        found, index = [], self._frames[link].joint
        while index >= 0:
            found.append(index)
            index = self._joints[index].parent
        return found

    @cached_property
    def _joints(self) -> list[Joint]:
        return list(self._robot.joints)

    def _joint(self, index: int) -> str:
        joint, limits = self._joints[index], self._robot.limits
        k = joint.coordinate
        placement = self._base @ joint.placement if joint.parent < 0 else joint.placement
        numbers = (joint.multiplier, joint.offset, float(limits.lower[k]), float(limits.upper[k]))
        name = self._robot.coordinate_names[k]
        return repr((joint.type.name, name, numbers, _rounded(placement), _rounded(joint.axis)))

    def _link(self, link: str) -> str:
        if link not in self._links:
            frame, mesh = self._frames[link], self._robot.collision_mesh(link)
            placement = self._base @ frame.placement if frame.joint < 0 else frame.placement
            content = [_rounded(placement), None if mesh is None else surface_hash(mesh)]
            if self._body is not None:
                content.append(self._cover(link))
            self._links[link] = repr(content)
        return self._links[link]

    def _cover(self, link: str) -> str:
        body = self._body
        assert body is not None
        own, digest = np.asarray(body.links) == link, hashlib.sha256()
        for array in (body.means, body.covariances, body.levels):
            if array is not None:
                digest.update(np.ascontiguousarray(np.asarray(array)[own], dtype=np.float64).tobytes())
        return digest.hexdigest()


def _rounded(array: np.ndarray) -> object:
    return (np.round(array, DECIMALS) + 0.0).tolist()  # + 0.0 makes -0.0 into 0.0
