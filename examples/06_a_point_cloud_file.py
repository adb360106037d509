"""A point cloud file.

Obstacles are points, so a depth camera's cloud can be used as it is. Merging points in voxels keeps every
point covered: the merged ball's radius is large enough to contain what it replaces. A larger radius also
widens the density, so psi is not the same.
"""

import tempfile
from pathlib import Path

import numpy as np
import trimesh

import sidestep as ss
from sidestep import thesis

# A scanned box, here made on the spot: 5000 points on its surface, written as PLY.
box = trimesh.creation.box((0.2, 0.4, 0.3))
scan = trimesh.sample.sample_surface(box, 5000, seed=0)[0] + [0.5, 0.1, 0.45]
path = Path(tempfile.mkdtemp()) / "scan.ply"
trimesh.PointCloud(scan).export(path)

cloud = ss.load_point_cloud(path)
merged = ss.load_point_cloud(path, voxel=0.05)
print(f"{len(cloud)} points in the file, {len(merged)} after merging in voxels of 5 cm")

distances = np.linalg.norm(cloud.points[:, None] - merged.points[None], axis=2) - merged.radii
print(f"every point is covered: {bool((distances.min(axis=1) <= 1e-6).all())}")

robot = ss.Robot.named("fr3_arm")
body = ss.Body.fit(robot, components=1, seed=0)
psi = thesis.CollisionDensity(robot, body, average=True)
values = [psi.evaluate(robot.neutral, np.zeros(7), points).values[0] for points in (cloud, merged)]
print(f"average density at rest: {values[0]:.3f} of all points, {values[1]:.3f} of the merged ones [1/m^3]")
