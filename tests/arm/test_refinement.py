"""Arms in seconds, and the fine body that follows them into a running controller."""

import time

import numpy as np
import pytest

import sidestep as ss
from sidestep.arm import Refinement
from sidestep.body.cover_certificate import certify
from sidestep.body.cover_refine import Ellipsoids

PLANAR = """<robot name="two">
  <link name="base"/>
  <link name="l1"><collision><origin xyz="0.15 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="l2"><collision><origin xyz="0.15 0 0"/><geometry><sphere radius="0.04"/></geometry></collision></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="2" effort="50"/></joint>
  <joint name="j2" type="revolute"><origin xyz="0.3 0 0"/><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="2" effort="50"/></joint>
</robot>"""


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
