"""Arms in seconds, and the fine body that follows them into a running controller."""

import time

import numpy as np
import pytest

import sidestep as ss
from sidestep.arm import Refinement
from sidestep.arm.tight_places import tight_links
from sidestep.body.cover_certificate import certify
from sidestep.body.cover_refine import Ellipsoids
from sidestep.obstacles import pose_at
from support.two_links import BOX, PLANAR, beside


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path))


@pytest.mark.slow
def test_a_draft_covers_every_triangle_and_the_fine_body_is_taken_over_without_a_stop():
    draft = ss.Arm.load(PLANAR, draft=True)
    assert draft.is_draft
    robot = ss.Robot.from_urdf(PLANAR)
    links = np.array(draft.body.links)
    for link in ("l1", "l2"):
        mine = links == link
        shapes = [
            np.linalg.cholesky(covariance) * np.sqrt(level)
            for covariance, level in zip(
                np.asarray(draft.body.covariances)[mine], draft.body.levels[mine], strict=True
            )
        ]
        ellipsoids = Ellipsoids(draft.body.means[mine], np.array(shapes))
        triangles = np.asarray(robot.collision_mesh(link).triangles, dtype=np.float64)
        assert certify(triangles, ellipsoids, tolerance=1e-4).complete

    controller = ss.Controller(draft, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles.none())
    goal, q, v = np.array([1.0, -1.0]), np.zeros(2), np.zeros(2)
    controller.set_goal(goal)
    refinement = Refinement(draft, controller)
    before, largest, last = len(controller.labels), 0.0, np.zeros(2)
    k, end = 0, time.monotonic() + 120.0
    while (k < 3000 or not refinement.is_done) and time.monotonic() < end:
        k += 1
        command = controller.step(q, v)
        largest = max(largest, float(np.abs(command.acceleration - last).max()))
        last = command.acceleration
        v = v + 0.001 * command.acceleration
        q = q + 0.001 * v
        if k > 3000:
            time.sleep(0.01)
    fine = refinement.wait(0.0)
    assert not fine.is_draft
    controller.step(q, v)
    assert controller.arm.content_hash == fine.content_hash != draft.content_hash
    assert len(controller.labels) != before
    assert np.abs(q - goal).max() < 1e-3
    assert largest <= 1.0 * (1.0 + 1e-9)  # [rad/s^2] a period of the jerk limit, 100/s times 10 rad/s^2

    again = ss.Arm.load(PLANAR, draft=True)  # the user's cache has the fine one by now
    assert not again.is_draft
    assert again.content_hash == fine.content_hash
    assert Refinement(again).is_done


@pytest.mark.slow
def test_what_fails_is_told_and_what_is_cancelled_stays_a_draft(tmp_path):
    path = tmp_path / "two.urdf"
    path.write_text(PLANAR)
    draft = ss.Arm.load(path, draft=True)
    path.unlink()
    with pytest.raises(RuntimeError, match=r"could not be made: FileNotFoundError.*two\.urdf"):
        Refinement(draft).wait(60.0)
    path.write_text(PLANAR)
    refinement = Refinement(draft)
    with pytest.raises(TimeoutError, match="not done after 0"):
        refinement.wait(0.0)
    refinement.cancel()
    with pytest.raises(RuntimeError, match="cancelled"):
        refinement.wait(0.0)
    assert refinement.arm is draft


@pytest.mark.slow
def test_a_goal_that_only_the_cover_blocks_is_reached_with_a_finer_one():
    arm = ss.Arm.load(BOX, components={"l2": 2})
    assert [proof.max_overshoot > 0.03 for proof in arm.proof if proof.link == "l2"] == [True]
    goal, q, v = np.array([0.5, 0.0]), np.array([-0.5, 0.0]), np.zeros(2)
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_goal(goal)
    controller.set_obstacles([beside(arm.robot, goal, 0.010)])
    for _ in range(3000):
        command = controller.step(q, v)
        q, v = command.position, command.velocity
    assert command.activity.name == "blocked"
    assert controller.goal_obstruction.link == "l2"
    assert "or with a finer cover of the link" in controller.explain()
    assert tight_links(controller, arm) == {"l2": 24}

    refinement = Refinement(arm, controller, watch=True)
    assert refinement.is_done
    end = time.monotonic() + 300.0
    while refinement.arm is arm and time.monotonic() < end:
        command = controller.step(q, v)
        q, v = command.position, command.velocity
        time.sleep(0.001)
    for _ in range(3000):
        command = controller.step(q, v)
        q, v = command.position, command.velocity
    refinement.cancel()
    assert refinement.arm.body.links.count("l2") == 24
    assert controller.goal_obstruction is None
    assert command.activity.name == "arrived"
    np.testing.assert_allclose(q, goal, atol=1e-6)


def test_finer_covers_are_not_made_where_they_cannot_help():
    arm = ss.Arm.load(PLANAR, draft=True)
    goal = np.array([0.5, 0.0])
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_goal(goal)
    middle = arm.robot.pose(goal, "l2") @ [0.15, 0.0, 0.0, 1.0]
    controller.set_obstacles([ss.Sphere(0.03, pose_at(middle[:3]), name="ball")])
    controller.step(np.zeros(2), np.zeros(2))
    assert controller.goal_obstruction is not None  # the mesh is in the ball
    assert tight_links(controller, arm) == {}
    controller.remove_obstacles()
    assert controller.goal_obstruction is None
    assert tight_links(controller, arm) == {}


def test_components_of_unknown_links_and_arms_without_meshes_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"unknown links \['hand'\]; the links with geometry are l1, l2"):
        ss.Arm.load(PLANAR, components={"hand": 24})
    with pytest.raises(
        ValueError, match="components of link 'l1' is 0, must be a whole number of at least 1"
    ):
        ss.Arm.load(PLANAR, components={"l1": 0})
    with pytest.raises(ValueError, match=r"unknown links \['hand'\]"):
        ss.Arm.load(PLANAR, components={"hand": 24}, draft=True)
    file = tmp_path / "two.arm"
    ss.Arm.load(PLANAR, draft=True).save(file)
    with pytest.raises(ValueError, match="components cannot be given for arm file"):
        ss.Arm.load(file, components={"l1": 24})
    with pytest.raises(ValueError, match=r"was read from an \.arm file"):
        Refinement(ss.Arm.load(file), watch=True)
