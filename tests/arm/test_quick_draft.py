"""What makes a draft quick, counted and not timed: meshes are made coarser for the search alone, and read once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import sidestep as ss
from sidestep.body.cover_certificate import certify
from sidestep.body.cover_problem import EFFORTS, LinkProblem
from sidestep.distance import self_collision
from sidestep.robot import planar_arm


def test_a_fine_mesh_is_searched_coarsely_and_proven_on_all_its_triangles() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=0.05)
    mesh.vertices[:, 2] *= 2.0
    triangles = np.asarray(mesh.triangles, dtype=np.float64)
    draft = EFFORTS["draft"]
    assert len(triangles) == 20480 > draft.merged
    problem = LinkProblem(triangles, seed=0, effort=draft)
    cover = problem.finish(3)
    assert len(problem.surface.triangles) < len(triangles) / 2
    assert certify(triangles, cover.ellipsoids, tolerance=draft.piece * problem.surface.size).complete
    assert cover.measured.mean < 5e-3  # [m] an ellipsoid of 5 cm and 10 cm is covered by three closely
    assert LinkProblem(triangles, seed=0).effort.merged == 0  # the fine one is searched on all of them


def test_the_trees_of_a_mesh_are_built_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path))
    built: list[int] = []
    model = self_collision.mesh_model

    def counted(mesh: trimesh.Trimesh) -> object:
        built.append(len(mesh.faces))
        return model(mesh)

    monkeypatch.setattr(self_collision, "mesh_model", counted)
    arm = ss.Arm.load(planar_arm(4).replace('size="0.', 'size="0.0'), draft=True)
    assert arm.num_coordinates == 4
    assert built == [12] * 4


def test_configurations_of_a_coordinate_do_not_depend_on_the_others() -> None:
    short, long = (ss.Robot.from_urdf(planar_arm(count)) for count in (2, 3))
    first, second = short.random_configurations(50), long.random_configurations(50)
    assert first.shape == (50, 2)
    np.testing.assert_array_equal(first, second[:, :2])
    assert np.ptp(second, axis=0).min() > 4.0  # [rad] of the 2 pi of each
    assert abs(np.corrcoef(second.T)[0, 1]) < 0.4  # of independent ones 0.14 is the standard error
    assert not np.array_equal(first, short.random_configurations(50, seed=1))
