"""Distance between the ellipsoids of a covering body and the scene: what a controller can know at best."""

from __future__ import annotations

import coal
import numpy as np
import numpy.typing as npt

from sidestep.body import Body
from sidestep.distance.clearance import Clearance
from sidestep.distance.scene import Scene, check_scene
from sidestep.distance.solid import object_solid
from sidestep.math.pose import pose_at
from sidestep.robot import Robot
from sidestep.shapes import KINDS

Array = npt.NDArray[np.float64]


class EllipsoidClearance:
    """Signed distance between the ellipsoids of a calibrated body and solids, by Coal.

    Beside `ExactClearance` it says what the cover costs: their difference is its overshoot towards the scene.
    Negative is the depth of the overlap. Links that no joint moves are left out.

    Args:
        robot: the arm. body: calibrated (`Body.cover`). objects: the scene.

    Raises:
        ValueError: the body has no levels, or an object is a mesh.
    """

    def __init__(self, robot: Robot, body: Body, objects: Scene) -> None:
        if body.levels is None:
            raise ValueError("the body has no levels; Body.cover(robot) makes one that holds every link")
        self.robot = robot
        self.objects = check_scene(objects)
        for item in self.objects:
            if item.shape.coal() is None:
                solids = sorted(name for name, kind in KINDS.items() if kind.coal_class is not None)
                raise ValueError(
                    f"object {item.name!r} is a {item.kind}; solids are needed: {', '.join(solids)}"
                )
        moves = {frame.name: frame.joint >= 0 for frame in robot.frames}
        self._ellipsoids: list[tuple[str, coal.Ellipsoid, Array, float]] = []
        for link, mean, covariance, level in zip(
            body.links, body.means, body.covariances, body.levels, strict=True
        ):
            if moves[link]:
                variances, axes = np.linalg.eigh(covariance)
                axes[:, 0] *= np.sign(np.linalg.det(axes))
                radii = np.sqrt(level * variances)
                self._ellipsoids.append(
                    (link, coal.Ellipsoid(*radii), pose_at(mean, axes), float(radii.max()))
                )

    def distance(self, q: Array) -> Clearance:
        """The closest ellipsoid and object at q (nv,)."""
        best = Clearance(float("inf"), "", "", np.zeros(3), np.zeros(3))
        solids = [(object_solid(item), item.pose) for item in self.objects]
        request = coal.DistanceRequest()
        request.enable_signed_distance = True
        for link, shape, X_LE, extent in self._ellipsoids:
            X = self.robot.pose(q, link) @ X_LE
            at = coal.Transform3s(X[:3, :3], X[:3, 3])
            for solid, pose in solids:
                apart = float(np.linalg.norm(X[:3, 3] - pose[:3, 3])) - extent - solid.bounding_radius
                if apart >= best.distance:
                    continue
                result = coal.DistanceResult()
                placed = coal.Transform3s(pose[:3, :3], pose[:3, 3])
                value = coal.distance(shape, at, solid.shape, placed, request, result) - solid.radius
                if value < best.distance:
                    points = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
                    best = Clearance(float(value), link, solid.name, *points)
        return best
