"""The arm: one object and one file of everything that is prepared once, and its rigid-body dynamics."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from typer.testing import CliRunner

import sidestep as ss
from sidestep.cli import app

ROBOTS = [entry.name for entry in ss.robots() if entry.available]


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    robot = ss.Robot.named("planar3")
    return ss.Arm.from_robot(robot, ss.Body.cover(robot, components=2, cache=False))


@pytest.mark.slow
def test_a_file_holds_all_of_it_bit_for_bit(arm: ss.Arm, tmp_path: Path) -> None:
    path = tmp_path / "planar3.arm"
    arm.save(path)
    again = ss.Arm.load(path)
    assert again.content_hash == arm.content_hash
    assert again.robot.coordinate_names == arm.robot.coordinate_names
    np.testing.assert_array_equal(again.body.means, arm.body.means)
    np.testing.assert_array_equal(again.body.levels, arm.body.levels)
    assert again.pairs == arm.pairs
    q = np.array([0.3, -0.4, 1.1])
    np.testing.assert_array_equal(again.mass_matrix(q), arm.mass_matrix(q))
    again.save(tmp_path / "again.arm")
    assert (tmp_path / "again.arm").read_bytes() == path.read_bytes()


def test_no_damaged_file_is_taken_for_an_arm(arm: ss.Arm, tmp_path: Path) -> None:
    path = tmp_path / "whole.arm"
    arm.save(path)
    content = path.read_bytes()
    rng = np.random.default_rng(0)
    damaged = tmp_path / "damaged.arm"
    for at in rng.choice(len(content), 150, replace=False):
        damaged.write_bytes(content[:at] + bytes([content[at] ^ 0x40]) + content[at + 1 :])
        with pytest.raises(ValueError, match=r"damaged\.arm"):
            ss.Arm.load(damaged)
    for length in rng.choice(len(content), 150, replace=False):
        damaged.write_bytes(content[:length])
        with pytest.raises(ValueError, match=r"damaged\.arm"):
            ss.Arm.load(damaged)
    with pytest.raises(FileNotFoundError):
        ss.Arm.load(tmp_path / "none.arm")


@pytest.mark.parametrize("name", ROBOTS)
def test_dynamics_agree_with_pinocchio(name: str) -> None:
    robot = ss.Robot.named(name)
    if len(robot.pinocchio.joints) - 1 != robot.num_coordinates:
        pytest.skip("a mimic joint has a coordinate of its own there")
    model, rng = robot.pinocchio, np.random.default_rng(1)
    data = model.createData()
    for _ in range(20):
        q = robot.random_configuration(rng)
        v = rng.normal(size=len(q))
        full = pin.neutral(model)
        for k in range(len(q)):
            joint = model.joints[k + 1]
            if joint.nq == 2:  # a continuous joint: cosine and sine
                full[joint.idx_q : joint.idx_q + 2] = np.cos(q[k]), np.sin(q[k])
            else:
                full[joint.idx_q] = q[k]
        M = pin.crba(model, data, full)
        M = np.triu(M) + np.triu(M, 1).T
        # rounding of sums over a chain, relative to the largest entry
        np.testing.assert_allclose(robot.mass_matrix(q), M, atol=1e-9 * np.abs(M).max())
        h = pin.nonLinearEffects(model, data, full, v)
        np.testing.assert_allclose(robot.bias(q, v), h, atol=1e-9 * max(1.0, np.abs(h).max()))


def test_the_command_writes_what_the_library_would(arm: ss.Arm, tmp_path: Path) -> None:
    out = tmp_path / "planar2.arm"
    run = CliRunner().invoke(app, ["prepare", "planar2", "-o", str(out)])
    assert run.exit_code == 0, run.output
    assert ss.Arm.load(out).content_hash == ss.Arm.load("planar2").content_hash
    for wrong, word in (("arm.txt", "ends with .arm"), ("none/a.arm", "there is no folder")):
        refused = CliRunner().invoke(app, ["prepare", "planar2", "-o", str(tmp_path / wrong)])
        assert isinstance(refused.exception, ValueError)
        assert word in str(refused.exception)


def test_a_file_of_the_first_format_has_the_default_limits_of_jerk_and_torque_rate(tmp_path: Path) -> None:
    """planar2 as Sidestep wrote it before these limits were in the file."""
    path = Path(__file__).parent / "planar2_format1.arm"
    assert path.read_bytes()[8:12] == (1).to_bytes(4, "little")
    old, now = ss.Arm.load(path), ss.Arm.load("planar2")
    np.testing.assert_array_equal(old.limits.jerk, 100.0 * old.limits.acceleration)
    assert np.isinf(old.limits.effort_rate).all()
    np.testing.assert_array_equal(old.limits.effort, now.limits.effort)
    np.testing.assert_array_equal(old.body.means, now.body.means)
    old.save(tmp_path / "again.arm")
    assert (tmp_path / "again.arm").read_bytes()[8:12] == (2).to_bytes(4, "little")
    assert ss.Arm.load(tmp_path / "again.arm").content_hash == old.content_hash
