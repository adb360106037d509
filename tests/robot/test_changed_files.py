"""Files that are written anew while a program runs, in the same moment and with the same size: the new one counts."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

import sidestep as ss
from sidestep.distance import ExactClearance
from sidestep.obstacles import MeshShape, pose_at
from sidestep.shapes.mesh_reader import read_mesh

URDF = """<robot name="r"><link name="base"/><link name="tool"><collision><geometry>
<mesh filename="{file}"/></geometry></collision></link><joint name="j" type="revolute"><parent link="base"/>
<child link="tool"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
MJCF = """<mujoco model="m"><asset><mesh name="a" file="m.stl"/></asset><worldbody><body name="tool">
<joint name="j" axis="0 0 1" range="-1 1" limited="true"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<geom type="mesh" mesh="a"/></body></worldbody></mujoco>"""


def write_box(path: Path, size: float) -> None:
    """A cube; the time of the last change stays, as of a copy, or of a file system whose clock is coarse."""
    times = (path.stat().st_atime_ns, path.stat().st_mtime_ns) if path.exists() else None
    trimesh.creation.box((size, size, size)).export(path)
    if times is not None:
        os.utime(path, ns=times)


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # limits that were assumed
@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_a_robot_has_the_mesh_that_is_there_when_it_is_loaded(tmp_path: Path, kind: str) -> None:
    description = tmp_path / ("r.urdf" if kind == "urdf" else "r.xml")
    description.write_text(URDF.format(file="m.stl") if kind == "urdf" else MJCF)
    fingerprints = set()
    for size in (0.1, 0.3, 0.1):  # the last is known already
        write_box(tmp_path / "m.stl", size)
        robot = ss.Robot.from_urdf(description) if kind == "urdf" else ss.Robot.from_mjcf(description)
        mesh = robot.collision_mesh("tool")
        assert mesh is not None
        np.testing.assert_allclose(mesh.extents, size, rtol=1e-6)  # STL has single precision
        judge = ExactClearance(robot, [ss.Sphere(0.1, pose_at([1.0, 0.0, 0.0]))])
        assert judge.distance(np.zeros(1)).distance == pytest.approx(0.9 - size / 2, abs=1e-6)
        fingerprints.add(robot.fingerprint)
    assert len(fingerprints) == 2


def test_hash_and_triangles_are_of_one_content(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(URDF.format(file="m.stl"))
    write_box(tmp_path / "m.stl", 0.1)
    whole = ss.Robot.from_urdf(tmp_path / "r.urdf")
    hashed, drawn = (ss.Robot.from_urdf(tmp_path / "r.urdf") for _ in range(2))
    fingerprint, mesh = hashed.fingerprint, drawn.collision_mesh("tool")
    assert mesh is not None
    write_box(tmp_path / "m.stl", 0.3)  # between the hash and the triangles of one robot
    later = hashed.collision_mesh("tool")
    assert later is not None
    np.testing.assert_allclose(later.extents, 0.1, rtol=1e-6)  # STL has single precision
    assert drawn.fingerprint == fingerprint
    assert whole.fingerprint != fingerprint  # which had not looked yet


def test_the_body_of_a_mesh_is_kept_under_its_own_hash(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(URDF.format(file="m.stl"))
    for _ in range(2):  # the second time from the cache
        for size in (0.1, 0.3):
            write_box(tmp_path / "m.stl", size)
            body = ss.Body.cover(ss.Robot.from_urdf(tmp_path / "r.urdf"), components=1, effort="draft")
            assert body.levels is not None
            reach = np.sqrt(np.asarray(body.levels)[0] * np.diag(body.covariances[0]))
            # a ball around a cube reaches sqrt(3) times as far as a face; what is found is within 20 % of it
            assert reach.max() == pytest.approx(size / 2 * np.sqrt(3.0), rel=0.2)


def test_an_obstacle_is_the_mesh_that_is_there_when_it_is_told(tmp_path: Path) -> None:
    path = tmp_path / "m.stl"
    for size in (0.1, 0.3, 0.1):
        write_box(path, size)
        centres, radii = MeshShape(path).balls()
        reach = (np.abs(centres) + radii[:, None]).max()
        assert size / 2 - 1e-6 <= reach < size / 2 + 0.02  # the excess is a few millimetres
        np.testing.assert_allclose(MeshShape(path).mesh().extents, size, rtol=1e-6)


def test_the_buffers_beside_a_gltf_are_part_of_it(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(URDF.format(file="m.gltf"))
    fingerprints, texts = [], []
    for size in (0.1, 0.3):
        for name, content in trimesh.creation.box((size, size, size)).export(file_type="gltf").items():
            (tmp_path / ("m.gltf" if name == "model.gltf" else name)).write_bytes(content)
        document = json.loads((tmp_path / "m.gltf").read_text())
        for item in (*document["accessors"], *document["meshes"]):
            for name in ("min", "max", "extras"):
                item.pop(name, None)
        (tmp_path / "m.gltf").write_text(json.dumps(document))
        texts.append((tmp_path / "m.gltf").read_text())
        np.testing.assert_allclose(
            read_mesh(tmp_path / "m.gltf").extents, size, rtol=1e-6
        )  # single precision
        robot = ss.Robot.from_urdf(tmp_path / "r.urdf")
        mesh = robot.collision_mesh("tool")
        assert mesh is not None
        np.testing.assert_allclose(mesh.extents, size, rtol=1e-6)
        fingerprints.append(robot.fingerprint)
    assert texts[0] == texts[1]  # the text is the same, the buffers are not
    assert fingerprints[0] != fingerprints[1]
