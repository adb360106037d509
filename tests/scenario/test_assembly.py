"""From a scenario to the parts of a run."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from sidestep._core import Controller, DistanceSwitch, GeometricSystem, Obstacles
from sidestep.distance import SceneObject
from sidestep.math.pose import from_roll_pitch_yaw, pose_at
from sidestep.robot import Robot, planar_arm
from sidestep.scenario import Scenario, ScenarioError
from sidestep.scenario.assembly import Assembly, assemble, solids
from sidestep.scenario.perception import seen_at, view_of
from sidestep.studio.snippet import robot_code

BASE = """\
format: 1
name: small
robot: {name: planar2}
start: {unit: deg, position: [0, 90], velocity: [10, 0]}
goal: {unit: rad, position: [0.5, 0.25]}
body: {components: 1}
obstacles:
  - {shape: {type: sphere, radius: 0.05}, position: [0.9, 0.1, 0.2]}
"""


@pytest.fixture(autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "bodies"))


def parse(text: str, folder: Path | None = None) -> Scenario:
    return Scenario.from_text(text, file="file.yaml", folder=folder)


def with_obstacle(text: str) -> Scenario:
    return parse(BASE[: BASE.index("  - {shape")] + f"  - {text}\n")


def test_degrees_become_radians() -> None:
    parts = assemble(parse(BASE))
    np.testing.assert_allclose(parts.start, [0.0, math.pi / 2], rtol=1e-15)  # one rounding of the conversion
    np.testing.assert_allclose(parts.start_velocity, [math.pi / 18, 0.0], rtol=1e-15)
    assert parts.goal.tolist() == [0.5, 0.25]


def test_the_controller_sees_the_bare_centre_and_physics_the_ball() -> None:
    parts = assemble(parse(BASE))
    assert isinstance(parts.seen, Obstacles)
    assert parts.seen.points.tolist() == [[0.9, 0.1, 0.2]]
    assert parts.seen.radii.tolist() == [0.0]
    (ball,) = parts.objects
    assert (ball.name, ball.kind, ball.size, ball.motion) == ("obstacle0", "sphere", (0.05,), "fixed")


def test_a_ball_is_seen_with_its_radius_where_asked() -> None:
    parts = assemble(parse(BASE.replace("0.2]}", "0.2], points: ball}")))
    assert isinstance(parts.seen, Obstacles)
    assert parts.seen.radii.tolist() == [0.05]


def test_a_turned_box_is_seen_by_its_surface() -> None:
    scenario = with_obstacle(
        "{shape: {type: box, size: [0.4, 0.2, 0.1]}, position: [1, 0, 0], rotation_deg: [0, 0, 90], "
        "points: surface}"
    )
    parts = assemble(scenario)
    assert isinstance(parts.seen, Obstacles)
    points = parts.seen.points - [1.0, 0.0, 0.0]
    half = np.array([0.1, 0.2, 0.05])  # turned by 90 degrees, x and y change places
    assert np.all(np.abs(points) <= half + 1e-9)
    assert np.all(np.isclose(np.abs(points), half, atol=1e-9).any(axis=1))  # on a face, to rounding
    assert len(points) > 50


def test_a_dropped_ball_moves_between_its_times_only() -> None:
    scenario = with_obstacle(
        "{shape: {type: sphere, radius: 0.05}, position: [1, 1, 0], "
        "motion: {to: [1, 0, 0], begin: 1, end: 3}}"
    )
    parts = assemble(scenario)
    assert callable(parts.seen)
    seen = [parts.seen(time) for time in (0.5, 2.0, 4.0)]
    # positions by linear interpolation; one rounding
    np.testing.assert_allclose([o.points[0] for o in seen], [[1, 1, 0], [1, 0.5, 0], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(
        [o.velocities[0] for o in seen], [[0, 0, 0], [0, -0.5, 0], [0, 0, 0]], atol=1e-15
    )
    assert [item.pose_at(2.0)[1, 3] for item in parts.objects] == [0.5]


def test_a_point_cloud_becomes_one_ball_per_point(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", np.array([[0.1, 0.0, 0.0], [0.0, 0.2, 0.0]]))
    text = BASE.replace("{type: sphere, radius: 0.05}", "{type: points, file: cloud.npy, radius: 0.01}")
    parts = assemble(parse(text, folder=tmp_path))
    assert [item.name for item in parts.objects] == ["obstacle0.0", "obstacle0.1"]
    assert isinstance(parts.seen, Obstacles)
    np.testing.assert_allclose(
        parts.seen.points, [[1.0, 0.1, 0.2], [0.9, 0.3, 0.2]], rtol=1e-15
    )  # one addition


def test_the_switch_and_embedding_are_those_asked_for() -> None:
    text = BASE + "embedding: {joint_limits: {slope: 10}, combine: stack}\n"
    text += "system: {stiffness: 2, switch: {type: distance, thresholds: [0.1, 0.2], slope: 30}}\n"
    system = assemble(parse(text)).mover
    assert isinstance(system, GeometricSystem)
    assert isinstance(system.switch, DistanceSwitch)
    assert system.switch.thresholds.tolist() == [0.1, 0.2]
    assert system.num_embedding_coordinates == 2
    summed = assemble(parse(text.replace("stack", "sum"))).mover
    assert isinstance(summed, GeometricSystem)
    assert summed.num_embedding_coordinates == 1
    np.testing.assert_array_equal(system.stiffness, 2.0 * np.eye(2))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("planar2", "planr2", "small: robot: no robot is named 'planr2'"),
        ("[0.5, 0.25]", "[0.5, 4.0]", "small: goal.position: joint 'joint2' is 4.0 rad, allowed: [-3.14"),
        ("[0, 90]", "[0, 90, 0]", "small: start.position has 3 values; robot 'planar2' has 2 coordinates"),
        ("[10, 0]", "[1000, 0]", "small: start.velocity: joint 'joint1' is 17.4"),
        ("[10, 0]", "[1]", "small: start.velocity has 1 values"),
        ("components: 1", "components: {link1: 1}", "small: body: components has no number for links link2"),
        (
            "{type: sphere, radius: 0.05}",
            "{type: mesh, file: no.stl}",
            "small: obstacles[0]: shape.file: there is no file",
        ),
        ("{name: planar2}", "{name: planar2, tip: link1}", "small: robot: tip go with 'urdf'"),
        ("{name: planar2}", "{urdf: no.urdf}", "small: robot"),
        (
            "components: 1}",
            "components: 1}\nsystem: {switch: {type: distance, thresholds: [1], slope: 1}}",
            "small: system: switch.thresholds has 1 values; robot 'planar2' has 2 coordinates (joint1,",
        ),
        (
            "obstacles:\n",
            "obstacles:\n  - {name: obstacle1, shape: {type: sphere, radius: 1}, position: [9, 9, 9]}\n",
            "small: obstacles: two objects of the scene are named 'obstacle1'",
        ),
    ],
)
def test_impossible_wishes_name_the_place(old: str, new: str, message: str) -> None:
    assert old in BASE
    with pytest.raises(ScenarioError) as caught:
        assemble(parse(BASE.replace(old, new, 1)))
    assert message in str(caught.value).replace("['link2']", "link2")


def test_numbers_of_the_look_ahead_that_do_not_go_together_are_named() -> None:
    text = POSE.format(method="barrier", frame="tip", activation=0.12).replace(
        "controller: {", "controller: {look_ahead: {delay: 3.0}, "
    )
    with pytest.raises(ScenarioError, match=r"method: .*delay is 3\.0*, must be no longer than the horizon"):
        assemble(Scenario.from_text(text))


@pytest.mark.slow
def test_the_barrier_method_sees_real_sizes_covers_the_links_and_leaves_the_goal_free() -> None:
    scenario = Scenario.from_text(
        """
format: 1
name: small
method: barrier
robot: {name: planar2}
start: {unit: rad, position: [1.0, 0.3]}
goal: {unit: rad, position: [-1.0, 0.3]}
body: {ellipsoids: 2}
obstacles:
  - {name: ball, shape: {type: sphere, radius: 0.05}, position: [1.1, 0.0, 0.0]}
"""
    )
    parts = assemble(scenario)
    assert isinstance(parts.seen, Obstacles)
    np.testing.assert_array_equal(parts.seen.radii, [0.05])
    assert isinstance(parts.mover, Controller)
    assert parts.mover.settings.planner is None
    assert parts.mover.settings.local_minimum is not None
    assert len(parts.body.levels) == parts.body.num_components
    drive = parts.driver.drive(0.0, parts.goal, np.zeros(2), np.eye(2), np.zeros(2))
    np.testing.assert_array_equal(drive.values, 0.0)
    assert drive.wanted == pytest.approx([0.0, 0.0], abs=1e-12)
    assert drive.system_status == "arrived"


POSE = """
format: 1
name: pose
method: {method}
robot: {{name: planar3}}
start: {{unit: rad, position: [0.2, 0.3, 0.4]}}
goal: {{frame: {frame}, position: [0.5, 0.6, 0.0], rotation_deg: [0, 0, 90]}}
body: {{ellipsoids: 2}}
controller: {{barriers: {{activation: {activation}}}}}
obstacles:
  - {{name: crate, shape: {{type: box, size: [0.1, 0.1, 0.1]}}, position: [-0.9, 0.0, 0.0]}}
"""


@pytest.mark.slow
def test_a_pose_is_reached_from_a_posture_that_has_it() -> None:
    parts = assemble(Scenario.from_text(POSE.format(method="barrier", frame="tip", activation=0.12)))
    assert parts.pose is not None
    expected = pose_at([0.5, 0.6, 0.0], from_roll_pitch_yaw([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(parts.pose.goal.pose, expected, atol=1e-15)
    assert isinstance(parts.mover, Controller)
    assert parts.mover.target is None
    parts.mover.step(parts.start, np.zeros(3))
    assert parts.mover.target is not None
    found = parts.robot.pose(parts.mover.target, "tip")
    np.testing.assert_allclose(found, expected, atol=1e-7)  # what counts as there
    assert parts.mover.settings.local_minimum is not None
    assert parts.mover.settings.look_ahead is not None
    alone = assemble(Scenario.from_text(POSE.format(method="reactive", frame="tip", activation=0.12))).mover
    assert isinstance(alone, Controller)
    assert (alone.settings.local_minimum, alone.settings.look_ahead) == (None, None)


@pytest.mark.slow
def test_a_barrier_sees_a_box_without_gaps() -> None:
    parts = assemble(Scenario.from_text(POSE.format(method="barrier", frame="tip", activation=0.12)))
    assert isinstance(parts.seen, Obstacles)
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.05, 0.05, (200, 3))
    points[np.arange(200), rng.integers(0, 3, 200)] = 0.05  # on its faces
    gaps = np.linalg.norm(points[:, None] + [-0.9, 0.0, 0.0] - parts.seen.points, axis=2) - parts.seen.radii
    assert gaps.min(axis=1).max() <= 0.0


@pytest.mark.parametrize(
    ("method", "frame", "activation", "message"),
    [
        ("barrier", "hand", 0.1, "goal.frame is 'hand'; allowed: link1, link2, link3, tip"),
        (
            "barrier",
            "tip",
            0.001,
            "controller.barriers.activation is 0.001; it must be at least 0.01",
        ),
    ],
)
def test_what_does_not_fit_is_named(method: str, frame: str, activation: float, message: str) -> None:
    text = POSE.format(method=method, frame=frame, activation=activation) + "simulation: {mode: kinematic}\n"
    with pytest.raises(ScenarioError) as caught:
        assemble(Scenario.from_text(text))
    assert message in str(caught.value)


def test_a_cloud_in_millimetres_is_scaled_and_its_holes_are_left_out(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", [[[100.0, 0.0, 0.0], [np.nan] * 3, [0.0, 200.0, 0.0]]])
    shape = "{type: points, file: cloud.npy, radius: 0.01, scale: 0.001}"
    text = BASE.replace("{type: sphere, radius: 0.05}", shape)
    with pytest.warns(RuntimeWarning, match="1 of 3 points are not finite and were dropped"):
        parts = assemble(parse(text, tmp_path))
    assert isinstance(parts.seen, Obstacles)
    np.testing.assert_allclose(parts.seen.points, [[1.0, 0.1, 0.2], [0.9, 0.3, 0.2]], rtol=1e-15)


def test_a_cloud_is_placed_from_its_viewpoint(tmp_path: Path) -> None:
    head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0.5 0 0 0 0 0 1\nPOINTS 1\n"
    (tmp_path / "cloud.pcd").write_text(head + "DATA ascii\n0.1 0.2 0.3\n")
    shape = "{type: points, file: cloud.pcd, radius: 0.01, viewpoint: true}"
    scenario = parse(BASE.replace("{type: sphere, radius: 0.05}", shape), tmp_path)
    parts = assemble(scenario)
    assert isinstance(parts.seen, Obstacles)
    # half a turn about z, 0.5 m ahead, around the obstacle's position; roundings
    np.testing.assert_allclose(parts.seen.points, [[1.3, -0.1, 0.5]], rtol=1e-14)
    scenario.save(tmp_path / "again.yaml")
    assert Scenario.load(tmp_path / "again.yaml").obstacles == scenario.obstacles


def test_a_cloud_of_many_points_is_merged_on_request(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(0.0, 0.2, (60, 70, 3))
    np.save(tmp_path / "cloud.npy", points)
    shape = "{{type: points, file: cloud.npy, radius: 0.01{}}}"
    with pytest.raises(
        ScenarioError, match=r"cloud\.npy gives 4200 points; at most 2000 .* A voxel, here none, merges"
    ):
        assemble(parse(BASE.replace("{type: sphere, radius: 0.05}", shape.format("")), tmp_path))
    text = BASE.replace("{type: sphere, radius: 0.05}", shape.format(", voxel: 0.05"))
    text = text.replace("0.1, 0.2]", "0.1, 0.2], points: ball")
    parts = assemble(parse(text, tmp_path))
    assert isinstance(parts.seen, Obstacles)
    radius = parts.seen.radii[0]
    np.testing.assert_array_equal(parts.seen.radii, np.full(64, radius))
    assert {item.size for item in parts.objects} == {(radius,)}
    offsets = points.reshape(-1, 1, 3) + np.array([0.9, 0.1, 0.2]) - parts.seen.points
    # every ball of the file is inside of one that is seen; rounding at the scale of a metre
    assert (np.linalg.norm(offsets, axis=2).min(axis=1) + 0.01 - radius).max() <= 1e-12


def seen_by_a_controller(text: str) -> tuple[SceneObject, Obstacles]:
    scenario = with_obstacle(text)
    (item,) = scenario.obstacles
    (thing,) = solids(scenario, item, item.name or "obstacle0")
    return thing, seen_at((view_of(item, thing, bare=False),), 0.0)


def test_capsules_and_planes_are_solids_and_balls_with_their_names() -> None:
    rod, seen = seen_by_a_controller(
        "{name: rod, shape: {type: capsule, radius: 0.05, length: 0.3}, position: [0.9, 0.1, 0.2]}"
    )
    assert (rod.kind, rod.size) == ("capsule", (0.05, 0.3))
    assert seen.groups == [("rod", len(seen))]
    np.testing.assert_allclose(seen.points[:, :2], [[0.9, 0.1]] * len(seen), atol=1e-12)
    assert seen.radii.max() <= 0.052 + 1e-12
    wall, seen = seen_by_a_controller(
        "{name: wall, excess: 0.01, shape: {type: plane, extent: 1.5}, position: [0, 2, 0], rotation_deg: [90, 0, 0]}"
    )
    assert (wall.kind, wall.size, wall.motion) == ("plane", (1.5,), "fixed")
    assert seen.groups == [("wall", len(seen))]
    # its z axis is -y of the world: solid beyond y = 2, and balls reach out of it by the excess at most
    assert (seen.points[:, 1] - seen.radii).min() == pytest.approx(1.99, abs=2e-3)
    assert (seen.points[:, 1] - seen.radii).min() >= 1.99 - 1e-9
    with pytest.raises(ScenarioError, match="free is true; a plane can only be fixed"):
        with_obstacle("{name: wall, free: true, shape: {type: plane}, position: [0, 2, 0]}")


LACKING = """
format: 1
name: lacking
robot: {{urdf: arm.urdf{more}}}
start: {{unit: rad, position: [0, 0]}}
goal: {{unit: rad, position: [0.5, 0.3]}}
method: {method}
simulation: {{mode: {mode}, duration: 0.1}}
"""


@pytest.mark.filterwarnings("ignore:.*no effort limit:RuntimeWarning")
@pytest.mark.parametrize("method", ["custom", "reactive"])
def test_torque_needs_effort_limits_and_inertias(tmp_path: Path, method: str) -> None:
    text = re.sub(r'effort="[^"]*"', 'effort="0"', planar_arm(2))
    (tmp_path / "arm.urdf").write_text(text)

    def assembled(mode: str, more: str = "") -> Assembly:
        return assemble(parse(LACKING.format(method=method, mode=mode, more=more), tmp_path))

    with pytest.raises(
        ScenarioError,
        match=r"simulation\.mode is 'torque', and joints of robot 'planar2' have no effort limit: joint1, joint2; "
        r"write robot\.effort_limits: \{joint1: 87\.0\} \[Nm \| N\], or mode: kinematic",
    ):
        assembled("torque")
    assert np.isinf(assembled("kinematic").robot.limits.effort).all()
    given = assembled("torque", ", effort_limits: {joint1: 87, joint2: 12.5}, velocity_limits: {joint2: 0.5}")
    np.testing.assert_array_equal(given.robot.limits.effort, [87.0, 12.5])
    np.testing.assert_array_equal(given.robot.limits.velocity, [5.0, 0.5])
    with pytest.raises(ScenarioError, match=r"no coordinate 'elbow'; its joints are: joint1, joint2"):
        assembled("kinematic", ", effort_limits: {elbow: 87}")
    with pytest.raises(ScenarioError, match="effort_limits"):
        assembled("kinematic", ", effort_limits: {joint1: -1}")
    massless = re.sub(r"<inertial>.*?</inertial>", "", planar_arm(2), flags=re.DOTALL)
    (tmp_path / "arm.urdf").write_text(massless)
    with pytest.raises(ScenarioError, match=r"no moving link of robot 'planar2' has an <inertial> with mass"):
        assembled("torque")
    assert assembled("kinematic").robot.num_coordinates == 2


def test_joints_are_locked_at_the_value_of_a_posture(tmp_path: Path) -> None:
    text = LACKING.format(method="custom", mode="kinematic", more=", locked: {joint3: bent}")
    (tmp_path / "arm.urdf").write_text(planar_arm(3))
    state = '<group_state name="bent" group="arm"><joint name="joint3" value="0.7"/></group_state>'
    (tmp_path / "arm.srdf").write_text(f'<robot name="planar3">{state}</robot>')
    robot = assemble(parse(text, folder=tmp_path)).robot
    assert (robot.held, robot.num_coordinates) == ({"joint3": 0.7}, 2)
    with pytest.raises(ScenarioError, match=r"robot: locked: 'joint3' is 'straight', .*one of: bent"):
        assemble(parse(text.replace("bent", "straight"), folder=tmp_path))


def test_a_joint_of_a_file_is_driven_within_a_range(tmp_path: Path) -> None:
    text = LACKING.format(method="custom", mode="kinematic", more=", locked: {joint3: [0.5, 0.9]}")
    (tmp_path / "arm.urdf").write_text(planar_arm(3))
    scenario = parse(text, folder=tmp_path)
    robot = assemble(scenario).robot
    assert (robot.held, robot.num_coordinates) == ({"joint3": pytest.approx(0.7)}, 2)
    whole = Robot.from_urdf(tmp_path / "arm.urdf", locked={"joint3": (0.5, 0.9)})
    assert robot.fingerprint == whole.fingerprint
    assert "locked={'joint3': (0.5, 0.9)}" in robot_code(scenario.robot, scenario)
    for wrong, words in (
        ("[0.5]", "joint3"),
        ("[0.5, 0.6, 0.7]", "joint3"),
        ("[0.9, 0.5]", "range that ascends"),
    ):
        with pytest.raises(ScenarioError, match=words):
            assemble(parse(text.replace("[0.5, 0.9]", wrong), folder=tmp_path))


def test_a_joint_of_a_named_robot_is_locked() -> None:
    text = LACKING.format(method="controller", mode="kinematic", more=", locked: {joint3: 0.7}")
    scenario = parse(text.replace("urdf: arm.urdf", "name: planar3"))
    robot = assemble(scenario).robot
    assert (robot.name, robot.held, robot.num_coordinates) == ("planar3", {"joint3": 0.7}, 2)
    assert robot.fingerprint == Robot.named("planar3", locked={"joint3": 0.7}).fingerprint
    assert robot_code(scenario.robot, scenario) == "ss.Robot.named('planar3', locked={'joint3': 0.7})"
    with pytest.raises(
        ScenarioError, match=r"locked: joint 'elbow' does not exist; joints that can be locked: joint1"
    ):
        assemble(parse(text.replace("urdf: arm.urdf", "name: planar3").replace("joint3", "elbow")))


def test_limits_by_joint_go_with_a_file() -> None:
    text = LACKING.format(method="custom", mode="kinematic", more="").replace(
        "urdf: arm.urdf", "name: planar2"
    )
    with pytest.raises(ScenarioError, match="effort_limits go with 'urdf', not with a named robot"):
        assemble(parse(text.replace("planar2}", "planar2, effort_limits: {joint1: 1}}")))


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        (
            "{type: sphere, radius: 0.05}, position: [910, 760, 0]",
            "obstacles[0].position is [910.0, 760.0, 0.0], ",
        ),
        (
            "{type: sphere, radius: 50}, position: [0.9, 0.8, 0]",
            "obstacles[0].shape: the sphere is more than 100 m",
        ),
        (
            "{type: box, size: [60, 80, 70]}, position: [0.9, 0.8, 0]",
            "the box is more than 60 m wide; is it in met",
        ),
        (
            "{type: cylinder, radius: 20, length: 90}, position: [0.9, 0.8, 0]",
            "the cylinder is more than 40 m wide; is it in metres?",
        ),
        (
            "{type: sphere, radius: 0.05}, position: [0.9, 0.8, 0], motion: {to: [0, 400, 0], begin: 0, end: 1}",
            "obstacles[0].motion.to is [0.0, 400.0, 0.0], farther than 100 m; is it in metres?",
        ),
    ],
)
def test_obstacles_that_are_hardly_in_metres_are_warned_of(obstacle: str, message: str) -> None:
    with pytest.warns(RuntimeWarning, match=re.escape(message)):
        assemble(with_obstacle(f"{{shape: {obstacle}}}"))


def test_floors_walls_and_halls_are_not_warned_of(recwarn: pytest.WarningsRecorder) -> None:
    for shape in (
        "{type: box, size: [80, 80, 0.2]}",
        "{type: plane, extent: 30}",
        "{type: sphere, radius: 2}",
    ):
        assemble(with_obstacle(f"{{shape: {shape}, position: [0, 0, -3]}}"))
    assert not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]
