"""The arms that come with Sidestep: read without anything else, and taken where a robot equals one."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import sidestep as ss
from sidestep import shipped_arms
from sidestep.arm import clearance_tables
from sidestep.arm.link_pairs import tables_and_pairs
from sidestep.body.cover_certificate import certify
from sidestep.body.cover_overshoot import overshoot
from sidestep.body.cover_problem import FINE
from sidestep.body.cover_refine import Ellipsoids
from sidestep.body.cover_surface import LinkSurface
from sidestep.cli import app
from sidestep.robot import planar_arm

NAMES = [entry.name for entry in ss.robots()]
LIMIT = 'lower="-3.141592653589793" upper="3.141592653589793"'


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))


@pytest.fixture
def _nothing_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sidestep.body.body.cover_mixtures", None)
    monkeypatch.setattr("sidestep.arm.clearance_tables._measure", None)
    monkeypatch.setattr("sidestep.arm.link_pairs._find_pairs", None)


def robot_of(name: str) -> ss.Robot:
    try:
        robot = ss.Robot.named(name)
    except FileNotFoundError as error:
        pytest.skip(str(error))
    if robot.fingerprint != ss.Arm.load(name).provenance.fingerprint:
        pytest.skip("its package has other meshes by now: run benchmarks/ship_arms.py")
    return robot


@pytest.mark.slow
@pytest.mark.usefixtures("_nothing_is_made")
@pytest.mark.parametrize("name", NAMES)
def test_it_is_taken_for_its_robot_and_holds_every_link(name: str) -> None:
    robot, arm = robot_of(name), ss.Arm.load(name)
    assert ss.Arm.from_robot(robot).content_hash == arm.content_hash
    body = ss.Body.cover(robot)
    assert len(body.links) <= 80
    assert list(dict.fromkeys(body.links)) == [proof.link for proof in arm.proof]
    for proof in arm.proof:
        assert proof.coverage == 1.0
        mesh = robot.collision_mesh(proof.link)
        assert mesh is not None
        ks = [k for k, link in enumerate(body.links) if link == proof.link]
        offsets = mesh.vertices[None] - body.means[ks][:, None]
        shapes = np.asarray(body.levels)[ks, None, None] * body.covariances[ks]
        depth = np.einsum("kni,kij,knj->kn", offsets, np.linalg.inv(shapes), offsets).min(axis=0)
        assert depth.max() <= 1.0 + 1e-9
        surface = LinkSurface(np.asarray(mesh.triangles))
        ellipsoids = Ellipsoids(body.means[ks], np.linalg.cholesky(shapes))
        # Proven again on every triangle, of what the file holds, and by more than rounding, which is below 1e-13.
        ellipsoids = ellipsoids.scaled(np.full(len(ellipsoids), 1.0 - 1e-10))
        assert certify(surface.triangles, ellipsoids, tolerance=FINE.piece * surface.size).complete
    assert len(shipped_arms.shipped_file(name).read_bytes()) < 1_000_000  # type: ignore[union-attr]


@pytest.mark.slow
def test_that_of_the_fr3_overshoots_by_as_little_as_is_said() -> None:
    robot = robot_of("fr3")
    body = ss.Body.cover(robot)
    assert body.num_components <= 80
    for cover in body.link_covers:
        mesh = robot.collision_mesh(cover.link)
        assert mesh is not None
        surface = LinkSurface(np.asarray(mesh.triangles))
        ks = [k for k, name in enumerate(body.links) if name == cover.link]
        shapes = np.linalg.cholesky(np.asarray(body.levels)[ks, None, None] * body.covariances[ks])
        ellipsoids = Ellipsoids(body.means[ks], shapes)
        assert certify(surface.triangles, ellipsoids, tolerance=surface.size / 800).complete
        measured = overshoot(surface, ellipsoids)
        # The base, which no joint moves, by 15.6 mm.
        assert measured.maximum <= (16e-3 if cover.link == "fr3_link0" else 15e-3)
        assert measured.mean == pytest.approx(cover.mean_overshoot, rel=0.02)
        if cover.link.endswith("finger"):
            assert measured.mean <= 2e-3


def test_an_arm_is_read_and_controlled_without_its_package_and_heavy_modules() -> None:
    code = """
import sys
class Nothing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in BARRED:
            raise ImportError(name)
BARRED = ["coal", "mujoco", "pinocchio", "sklearn", "matplotlib", "trimesh", "scipy", "pybullet_data", "yaml"]
sys.meta_path.insert(0, Nothing())
import importlib.metadata
def no_distribution(name):
    raise importlib.metadata.PackageNotFoundError(name)
importlib.metadata.distribution = no_distribution
import sidestep as ss
for name in NAMES:
    arm = ss.Arm.load(name)
    assert arm.name == name and arm.body.num_components > 0
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_goal(arm.neutral)
    assert abs(arm.mass_matrix(arm.neutral)).min() >= 0.0
assert "sidestep.robot" not in sys.modules
"""
    code = code.replace("NAMES", repr(NAMES)).replace("arm.body.num_components", "len(arm.proof)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.usefixtures("_nothing_is_made")
def test_a_description_that_equals_a_shipped_robot_takes_its_cover_tables_and_pairs(tmp_path: Path) -> None:
    shipped = ss.Arm.load("planar3")
    path = tmp_path / "mine.urdf"
    path.write_text(planar_arm(3).replace('name="planar3"', 'name="mine"'))
    arm = ss.Arm.load(path)
    assert (arm.name, arm.provenance.source) == ("mine", "mine.urdf")
    assert shipped_arms.has_body(shipped, arm.body)
    assert arm.pairs == shipped.pairs
    assert [t.control.tobytes() for t in arm.tables] == [t.control.tobytes() for t in shipped.tables] != []
    body = ss.Body.cover(arm.robot)  # type: ignore[arg-type]
    assert (body.robot_name, body.num_components) == ("mine", len(arm.body.links))
    assert [fit.converged for fit in body.link_fits] == [True] * 3
    body.save(tmp_path / "body.json")
    again = ss.Body.load(tmp_path / "body.json", arm.robot)  # type: ignore[arg-type]
    np.testing.assert_array_equal(again.means, body.means)


def test_tables_and_pairs_of_other_limits_are_not_taken(tmp_path: Path) -> None:
    """Within ±0.5 rad the links of a planar arm are apart, within the shipped robot's limits they touch."""
    text = planar_arm(3)
    assert text.count(LIMIT) == 3, text
    path = tmp_path / "planar3.urdf"
    path.write_text(text.replace(LIMIT, 'lower="-0.5" upper="0.5"'))
    wide, narrow = ss.Robot.named("planar3"), ss.Robot.from_urdf(path)
    assert (narrow.name, narrow.fingerprint) == (wide.name, wide.fingerprint)
    assert [(t.first, t.second) for t in clearance_tables.clearance_tables(wide).tables] == [
        ("link1", "link3")
    ]
    assert clearance_tables.clearance_tables(narrow).apart == (("link1", "link3"),)
    body = ss.Body.cover(narrow)
    assert shipped_arms.has_body(ss.Arm.load("planar3"), body)
    assert tables_and_pairs(narrow, body) == ((), ())


def test_a_damaged_shipped_arm_is_left_out_with_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "shipped"
    shutil.copytree(shipped_arms.FOLDER, folder)
    (folder / "fr3.arm").write_bytes(b"nothing")
    monkeypatch.setattr(shipped_arms, "FOLDER", folder)
    with pytest.warns(RuntimeWarning, match=r"left out: .*fr3\.arm.*it is not an arm file"):
        assert shipped_arms.with_body_of(ss.Robot.named("planar3")) is not None
    with pytest.raises(ValueError, match="it is not an arm file"):
        ss.Arm.load("fr3")


@pytest.mark.slow
def test_the_command_tells_how_far_it_is_and_what_it_prepared(tmp_path: Path) -> None:
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/>'
        '<origin xyz="0.3 0 0"/><limit lower="-0.4" upper="0.4" velocity="1" effort="1"/></joint>'
        for k in range(3)
    )
    ball = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    links = "".join(f'<link name="l{k}">{ball if k else ""}</link>' for k in range(4))
    path = tmp_path / "balls.urdf"
    path.write_text(f'<robot name="balls">{links}{joints}</robot>')
    run = CliRunner().invoke(app, ["prepare", str(path), "-o", str(tmp_path / "balls.arm")])
    assert run.exit_code == 0, run.output
    assert re.search(r"^preparing balls\.urdf: \d+ of \d+, cover l[123]$", run.output, re.MULTILINE), (
        run.output
    )
    for line in ("balls: 3 joints", "j2: -0.4 to 0.4 rad, 1 rad/s", "body: 3 ellipsoids"):
        assert line in run.output
    assert "Arm: " in run.output.splitlines()[-2] + run.output.splitlines()[-1]
