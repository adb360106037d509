"""Tools fixed to a link: pose, inertia, fingerprint and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sidestep import Body, Robot
from sidestep.robot import Geometry


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.named("planar2")


def box() -> Geometry:
    return Geometry("box", np.eye(4), size=(0.1, 0.2, 0.3))


def test_a_tool_moves_with_its_link_and_adds_its_inertia(arm: Robot) -> None:
    pose = np.eye(4)
    pose[:3, 3] = [0.5, 0.0, 0.0]
    armed = arm.with_tool("gripper", box(), link="link2", pose=pose, mass=2.0)
    q = np.array([0.3, -0.7])
    np.testing.assert_allclose(armed.pose(q, "gripper"), arm.pose(q, "link2") @ pose, atol=1e-14)  # rounding
    # about joint 2: m (w^2 + d^2) / 12 + m r^2
    added = 2.0 * (0.1**2 + 0.2**2) / 12.0 + 2.0 * 0.5**2
    assert (armed.mass_matrix(q) - arm.mass_matrix(q))[1, 1] == pytest.approx(added, rel=1e-9)  # rounding
    assert armed.fingerprint != arm.fingerprint
    assert "gripper" not in [link.name for link in arm.links]


@pytest.mark.slow
def test_a_tool_is_covered_like_any_link(arm: Robot) -> None:
    armed = arm.with_tool("gripper", box(), link="link2")
    body = Body.cover(armed, components={"link1": 1, "link2": 1, "gripper": 2}, cache=False)
    assert list(body.links).count("gripper") == 2
    assert {cover.link: cover.coverage for cover in body.link_covers}["gripper"] == 1.0


def test_bad_tools_are_refused(arm: Robot) -> None:
    with pytest.raises(ValueError, match="must be new"):
        arm.with_tool("link1", box(), link="link2")
    with pytest.raises(ValueError, match="no link 'hand'"):
        arm.with_tool("gripper", box(), link="hand")
    with pytest.raises(ValueError, match="mass of tool 'gripper' is -1"):
        arm.with_tool("gripper", box(), link="link2", mass=-1.0)
    with pytest.raises(
        ValueError, match=r"tool 'gripper' is not a rigid transform .*: an entry of R Rᵀ - 1 is 3"
    ):
        arm.with_tool("gripper", box(), link="link2", pose=np.diag([2.0, 1.0, 1.0, 1.0]))
    with pytest.raises(FileNotFoundError, match=r"nowhere\.stl"):
        arm.with_tool("gripper", Path("nowhere.stl"), link="link2")
