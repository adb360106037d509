"""Objects in the gripper: how they are covered, and what an arm does with them."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.arm.attachment import attachment
from sidestep.obstacles import Box, Capsule, Cylinder, Sphere

HAND = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.25], [0, 0, 0, 1]])
Q = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785])
FINGERS = ["fr3_leftfinger", "fr3_rightfinger"]


def covers(shape, points, **options):
    """How far out of the ellipsoids the worst of some points is: at most 1 inside."""
    arm = ss.Arm.load("fr3")
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None))
    controller.attach("thing", shape, link="fr3_hand", **options)
    body = controller.arm.body
    mine = [k for k, link in enumerate(body.links) if link == "thing"]
    radii = [
        np.einsum(
            "ni,ij,nj->n", points - body.means[k], np.linalg.inv(body.covariances[k]), points - body.means[k]
        )
        / body.levels[k]
        for k in mine
    ]
    return float(np.min(radii, axis=0).max()), len(mine)


@pytest.mark.slow
def test_shapes_and_points_are_covered_whole():
    rng = np.random.default_rng(0)
    u = rng.normal(size=(4000, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    angle, height = rng.uniform(0.0, 2.0 * np.pi, 4000), rng.uniform(-0.06, 0.06, 4000)
    side = np.column_stack([0.04 * np.cos(angle), 0.04 * np.sin(angle), height])
    assert covers(Sphere(0.05), 0.05 * u) == (pytest.approx(1.0, abs=1e-9), 1)
    assert covers(Cylinder(0.04, 0.12), side)[0] <= 1.0
    ends = 0.03 * u + np.outer(np.sign(u[:, 2]), [0.0, 0.0, 0.05])
    assert covers(Capsule(0.03, 0.1), ends)[0] <= 1.0
    cloud = rng.uniform(-0.05, 0.05, (300, 3)) * [1.0, 0.5, 2.0]
    assert covers(cloud, cloud)[0] <= 1.0
    assert covers(cloud, cloud + 0.005 * u[:300], radius=0.005)[0] <= 1.0
    for flat in (cloud[:1], cloud[:2], cloud * [1.0, 1.0, 0.0]):
        assert covers(flat, flat)[0] <= 1.0


def test_a_pole_in_the_hand_goes_around_a_ball_that_the_bare_arm_does_not_see():
    arm, robot = ss.Arm.load("fr3"), ss.Robot.named("fr3")
    goal = np.array([0.9, *Q[1:]])
    middle = 0.5 * (Q + goal)
    X = robot.pose(middle, "fr3_hand") @ HAND
    ball = X[:3, 3] + X[:3, 2] * 0.12  # where the pole's lower end comes along
    pole = Box((0.03, 0.03, 0.3))

    def motion(attached):
        controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
        controller.set_obstacles(ss.Obstacles(ball[None], radii=0.03))
        controller.set_goal(goal)
        if attached:
            controller.attach("pole", pole, link="fr3_hand", pose=HAND, may_touch=FINGERS)
        moved = ss.integrate(controller, Q, np.zeros(7), steps=8000, goal=goal, tolerance=0.01)
        assert moved.arrived
        return moved.q

    def gap(motion):  # of the true box from the ball
        least = np.inf
        for q in motion[::2]:
            local = np.linalg.inv(robot.pose(q, "fr3_hand") @ HAND) @ [*ball, 1.0]
            outside = np.maximum(np.abs(local[:3]) - [0.015, 0.015, 0.15], 0.0)
            least = min(least, float(np.linalg.norm(outside)) - 0.03)
        return least

    assert gap(motion(attached=False)) < 0.0
    assert gap(motion(attached=True)) > 0.004


def test_its_mass_has_a_place_and_moments():
    made = attachment("cup", Box((0.1, 0.2, 0.3)), link="fr3_hand", pose=HAND, mass=1.2)
    assert made.inertial.mass == 1.2
    assert made.inertial.com == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    # m (b^2 + c^2) / 12 of a box
    assert made.inertial.inertia == pytest.approx(np.diag([0.013, 0.01, 0.005]), abs=1e-12)
    given = attachment("cup", Sphere(0.1), link="fr3_hand", mass=1.2, center_of_mass=[0.0, 0.01, 0.0])
    # 2/5 m r^2 of a ball, by triangles with corners on it
    assert given.inertial.inertia == pytest.approx(0.4 * 1.2 * 0.01 * np.eye(3), rel=1e-2, abs=1e-9)
    assert given.inertial.com == pytest.approx([0.0, 0.01, 0.0])


def test_what_is_wrong_is_named():
    controller = ss.Controller(ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
    for geometry, options, words in (
        (np.full((3, 3), np.nan), {}, "finite"),
        (np.zeros((0, 3)), {}, "at least one"),
        (Sphere(0.1), {"mass": -1.0}, "mass is -1"),
        (Sphere(0.1), {"radius": np.inf}, "radius is inf"),
        (Sphere(0.1), {"components": 0}, "components is 0"),
        (Sphere(0.1), {"pose": np.ones((4, 4))}, "pose"),
        (Sphere(0.1), {"link": "fr3_head"}, "fr3_head"),
        (Sphere(0.1), {"may_touch": ["fr3_head"]}, "fr3_head"),
    ):
        with pytest.raises(ValueError, match=words):
            controller.attach("cup", geometry, **{"link": "fr3_hand", **options})
    with pytest.raises(ValueError, match="a name and a geometry"):
        controller.attach("cup")
    with pytest.raises(
        ValueError, match=r"attach 'cup': a Plane .* allowed: Box, Capsule, Cylinder, MeshShape, Sphere, or"
    ):
        controller.attach("cup", ss.Plane([0, 0, 0], [0, 0, 1]), link="fr3_hand")
    assert controller.attached == []
    with pytest.raises(TypeError, match="name is None, must be the name of an object that is attached"):
        controller.detach(None)


def test_what_is_hardly_in_metres_or_kilograms_is_warned_of(recwarn):
    controller = ss.Controller(ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True))
    with pytest.warns(RuntimeWarning, match=r"attach 'pole': it is 8 m long; is its geometry in metres\?"):
        controller.attach("pole", Sphere(4.0), link="fr3_hand")
    controller.detach("pole")
    with pytest.warns(RuntimeWarning, match=r"attach 'cup': its mass is 600 kg; is that in kg\?"):
        controller.attach("cup", Sphere(0.05), link="fr3_hand", mass=600.0)
    controller.detach("cup")
    recwarn.clear()
    controller.attach("tool", Sphere(0.5), link="fr3_hand", mass=20.0)
    assert not recwarn.list


@pytest.mark.parametrize("rests_on", ["table", "*"])
def test_a_cup_that_stands_on_a_table_may_stay_there_until_it_is_lifted(rests_on):
    arm, robot = ss.Arm.load("fr3"), ss.Robot.named("fr3")
    X = robot.pose(Q, "fr3_hand_tcp")
    upright, below = np.eye(4), np.eye(4)
    upright[:3, 3] = X[:3, 3]
    below[:3, 3] = X[:3, 3] - [0.0, 0.0, 0.06 + 0.02]
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles([Box((0.6, 0.8, 0.04), below, name="table")])
    controller.step(Q, np.zeros(7))
    cup = Cylinder(0.035, 0.12)
    options = {
        "link": "fr3_hand",
        "pose": np.linalg.inv(robot.pose(Q, "fr3_hand")) @ upright,
        "may_touch": FINGERS,
    }
    controller.attach("cup", cup, rests_on=rests_on, **options)
    still = ss.integrate(controller, Q, np.zeros(7), steps=1000)
    assert np.abs(still.q - Q).max() < 1e-3
    assert min(still.clearance) > 0.005
    X[2, 3] += 0.15
    controller.set_goal(ss.PoseGoal(arm.robot, "fr3_hand_tcp", X))
    up = ss.integrate(controller, still.q[-1], still.v[-1], steps=4000)
    assert min(up.clearance) > 0.0
    assert robot.pose(up.q[-1], "fr3_hand_tcp")[2, 3] == pytest.approx(X[2, 3], abs=2e-3)
    with pytest.raises(ValueError, match="rests on 'tabel', which is no obstacle; there are: 'table'"):
        controller.attach("other", cup, rests_on="tabel", **options)


def test_an_object_far_from_the_link_that_holds_it_is_doubted(recwarn):
    arm = ss.Arm.load("fr3")
    cup, options = Cylinder(0.04, 0.12), {"link": "fr3_hand", "mass": 0.3, "may_touch": FINGERS}
    in_link = np.eye(4)
    in_link[2, 3] = 0.12
    in_world = arm.robot.pose(Q, "fr3_hand") @ in_link
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None))
    controller.set_obstacles(ss.Obstacles.none())

    def attach(pose, match=None):
        recwarn.clear()
        controller.attach("cup", cup, pose=pose, **options)
        controller.detach("cup")
        words = [str(one.message) for one in recwarn.list]
        assert len(words) == (match is not None)
        return words[0] if words else ""

    attach(in_link)
    # Where the arm is nobody has said yet: the distance alone is known, of the hand's surface from the cup's.
    distance = float(np.linalg.norm(in_world[:3, 3]))
    words = attach(in_world, match="far")
    told = float(words.split("it is ")[1].split(" m")[0])
    assert distance - 0.2 < told < distance  # the hand's longest half is 0.12 m, the cup's 0.07 m
    assert (
        "away from link 'fr3_hand' that holds it; pose is that of its frame in the frame of the link" in words
    )
    controller.step(Q, np.zeros(7))
    assert "looks like one in the world" in attach(in_world, match="world")
    attach(in_link)
    # A long tool's tip, and a cup in a gripper that the arm lacks, are no more than some hands away.
    tip = np.eye(4)
    tip[2, 3] = 0.35
    attach(tip)
    tip[2, 3] = 0.8
    assert "is it one in the world?" in attach(tip, match="far")
