"""The gallery of scenes, the three sliders and robots from files."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from sidestep import ExactClearance, Robot, Scenario
from sidestep.body import Body
from sidestep.distance import SelfCollision
from sidestep.drawing.views import hidden
from sidestep.scenario.assembly import load_robot
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio import messages as m
from sidestep.studio.clearance_monitor import solid_poses
from sidestep.studio.comparison import Tally, changes
from sidestep.studio.gallery import GALLERY, MOUSE_BALL, OPENING, ends_of
from sidestep.studio.methods import METHODS
from sidestep.studio.page.arm import link_meshes, reach
from sidestep.studio.page.camera import HALF, Viewpoint, clear_view, extent
from sidestep.studio.page.cameras import NEAR
from sidestep.studio.page.mouse import on_plane, within_reach
from sidestep.studio.page.obstacles import box_edges
from sidestep.studio.page.why import PATH_POINTS, PATH_STEP, along
from sidestep.studio.robot_file import scenario_of_upload
from sidestep.studio.scene_obstacle import ball, box, things_of
from sidestep.studio.session import Session
from sidestep.studio.start import scenario_of, starting_scenario
from sidestep.studio.systems import build_adapter, draft_arm, make_body
from sidestep.studio.three_sliders import SLIDERS

PLANAR = Path(__file__).parents[2] / "examples" / "planar3.urdf"
TO_AND_FRO = [label for label, scene in GALLERY.items() if scene.to_and_fro]
CLEAR = (
    0.025  # [m] of start and goal on the exact meshes: more than ellipsoids and the covering balls take up
)
FREE = (
    0.77,
    0.95,
)  # to either side and upwards, in halves of a window's height: between the panels of 1280 x 800


@pytest.mark.parametrize("label", TO_AND_FRO)
def test_start_and_goal_of_a_scene_are_free_and_in_view(label: str) -> None:
    scenario = GALLERY[label].load()
    robot = load_robot(scenario)
    things = things_of(scenario)
    exact = ExactClearance(robot, [solid for thing in things for solid in thing.solids])
    poses = solid_poses(things, np.array([thing.start for thing in things]))
    ends = ends_of(scenario, robot)
    assert len(ends) == 2
    for q in ends:
        assert exact.distance(q, poses).distance > CLEAR
        assert SelfCollision(robot).distance(q).distance > 0.0
    places = np.array([robot.pose(q, frame.name)[:3, 3] for q in ends for frame in robot.frames])
    solids = [thing.triangles for thing in things]
    direction = clear_view(places, solids)
    whole = extent(robot, link_meshes(robot), ends, solids, NEAR * reach(robot))
    view = Viewpoint.of(whole, direction)
    offsets = whole - view.position
    shown = offsets @ np.array([view.right, view.up]).T / (HALF * (offsets @ view.view))[:, None]
    assert (np.abs(shown) < FREE).all()
    assert (
        hidden(places, np.concatenate(solids), -direction).mean() < 0.5
    )  # links are wider than their frames
    (ball,) = (thing for thing in things if thing.name == MOUSE_BALL)
    others = np.concatenate([thing.triangles for thing in things if thing is not ball])
    middle = ball.start[:3, 3]
    assert not hidden(middle[None], others, -direction).any()
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 500)  # of points all over each triangle
    apart = np.linalg.norm(np.einsum("wk,fkd->fwd", weights, others) - middle, axis=2).min()
    assert apart > ball.size + 0.05


def test_the_studio_opens_with_the_table() -> None:
    assert starting_scenario() == GALLERY[OPENING].load()
    assert starting_scenario().method == "controller"


@pytest.mark.slow
def test_the_arm_goes_to_and_fro_at_the_table_without_touching() -> None:
    scenario = GALLERY["Table"].load()
    robot = load_robot(scenario)
    session = Session(scenario, prepare=make_body, goals=ends_of(scenario, robot), synchronous=True)
    goals = {session.snapshot().goal.tobytes()}  # type: ignore[union-attr]
    for _ in range(3000):  # [ms] there, and on the way back
        session.step()
    last = session.snapshot()
    goals.add(last.goal.tobytes())  # type: ignore[union-attr]
    assert len(goals) == 2
    assert last.touched == 0
    assert "arrived" in [event for _, event in last.events]


@pytest.mark.parametrize("slider", SLIDERS, ids=lambda slider: slider.label)
def test_a_slider_sets_what_it_shows_within_the_ranges(slider: object) -> None:
    from sidestep.studio.three_sliders import Slider

    assert isinstance(slider, Slider)
    method = METHODS["controller"]
    assert slider.of(method.defaults) == pytest.approx(slider.usual, rel=1e-12)
    robot = Robot.named("planar2")
    body = Body.cover(robot, components=2)
    scenario = scenario_of(RobotConfig(name="planar2"))
    for value in (slider.lower, slider.usual, slider.upper):
        numbers = slider.numbers(value, method)
        assert slider.of(numbers) == pytest.approx(value, rel=1e-12)
        assert method.in_range(numbers)
        build_adapter(method, robot, body, method.defaults | numbers, scenario)  # the controller takes them
    assert slider.numbers(slider.usual, method).items() <= method.defaults.items()
    assert not slider.applies_to(METHODS["thesis"].defaults)


def test_without_a_planner_a_slider_leaves_its_numbers_out() -> None:
    distance = SLIDERS[1]
    assert distance.numbers(20.0, METHODS["reactive"]) == {"safety_margin": 0.02}
    assert set(distance.numbers(20.0, METHODS["controller"])) == {
        "safety_margin",
        "planner_floor",
        "planner_margin",
        "look_ahead_clearance",
    }


def packed(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def test_a_robot_is_loaded_from_a_file_and_from_an_archive(tmp_path: Path) -> None:
    content = PLANAR.read_bytes()
    plain, zipped = tmp_path / "plain", tmp_path / "zipped"
    plain.mkdir()
    zipped.mkdir()
    archive = packed(
        {"arm/robots/arm.urdf": content, "arm/robots/more/other.urdf": content, "arm/notes.xml": b"<x/>"}
    )
    for scenario in (
        scenario_of_upload("planar3.urdf", content, plain),
        scenario_of_upload("arm.zip", archive, zipped),
    ):
        robot = load_robot(scenario)
        assert robot.num_coordinates == 3
        assert len(ends_of(scenario, robot)) == 2


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("arm.stl", b"", "allowed are .urdf, .xacro, .xml, .mjcf, .zip"),
        ("arm.zip", b"nothing", "is not a zip file"),
        ("arm.zip", packed({"readme.md": b"<robot"}), "holds no robot description"),
        (
            "arm.zip",
            packed({"a.urdf": b"<robot", "b.urdf": b"<robot"}),
            "several robot descriptions: a.urdf, b.urdf",
        ),
    ],
)
def test_what_is_no_robot_is_refused(name: str, content: bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        scenario_of_upload(name, content, tmp_path)


def test_a_scenario_from_a_file_has_a_draft_that_moves_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whose finer body takes over while it moves."""
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))
    scenario = scenario_of_upload("planar3.urdf", PLANAR.read_bytes(), tmp_path)
    session = Session(scenario, prepare=make_body, draft=draft_arm, synchronous=True)
    try:
        assert session.snapshot().draft
        waited = []

        class Done:
            is_done = False

            def wait(self, timeout: float) -> object:
                waited.append(timeout)
                return make_arm()

            def cancel(self) -> None: ...

        def make_arm() -> object:
            from sidestep.arm import Arm

            return Arm.from_robot(session.robot, Body.cover(session.robot, components=3))

        session._prepared._refinement = Done()  # type: ignore[assignment]
        for _ in range(40):
            session.step()
        assert session.snapshot().draft  # it goes on with the draft until the finer one is there
        session._prepared._hear("cover", "link1", 1, 3)
        assert session.snapshot().refining == "ellipsoids around link1 (1 of 3)"
        Done.is_done = True
        for _ in range(20):
            session.step()
        now = session.snapshot()
        assert waited == [0.0]
        assert not now.draft
        assert now.refining == ""
        assert now.events[-1][1] == "finer body taken over"
        assert now.touched == 0
    finally:
        session.stop()


def test_the_ribbon_has_points_that_are_near_each_other() -> None:
    path = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, -1.0]])
    points = along(path)
    assert np.abs(np.diff(points, axis=0)).max() <= PATH_STEP + 1e-12
    for corner in path:
        assert np.abs(points - corner).max(axis=1).min() < 1e-12
    assert len(along(np.array([[0.0, 0.0], [100.0, 0.0]]))) <= PATH_POINTS + 1


def test_the_mouse_is_followed_on_a_plane_above_the_ground() -> None:
    begin, ball, normal = np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    ray = np.array([1.0, 0.0, -0.5]) / np.linalg.norm([1.0, 0.0, -0.5])
    np.testing.assert_allclose(on_plane(begin, ray, ball, normal), [1.0, 0.0, 1.5], atol=1e-12)
    assert on_plane(begin, -ray, ball, normal) is None
    np.testing.assert_allclose(within_reach(np.array([0.5, 0.0, -1.0])), [0.5, 0.0, 0.06])
    assert np.linalg.norm(within_reach(np.array([3.0, 4.0, 1.0]))) == pytest.approx(1.6, rel=1e-9)


def test_what_counts_of_a_motion_begins_anew_with_it(make_session: object, scenario: Scenario) -> None:
    session: Session = make_session(scenario)  # type: ignore[operator]
    tally, first = Tally(), session.snapshot()
    tally.take(first)
    assert tally.arrived is None
    session.handle(m.SetJointGoal(first.q))
    session.step()
    tally.take(session.snapshot())
    assert tally.arrived == pytest.approx(session.period)
    tally.clearance = 0.1
    tally.take(first)  # of an earlier time: a restart
    assert (tally.arrived, tally.clearance) == (None, np.inf)


def test_the_other_method_has_the_obstacles_that_there_are(make_session: object, scenario: Scenario) -> None:
    session: Session = make_session(scenario)  # type: ignore[operator]
    before = session.snapshot().things
    small, crate = ball("ball", np.array([0.9, 0.0, 0.0]), 0.01), box("crate", np.ones(3), np.full(3, 0.1))
    assert changes(before, before) == []
    assert changes(before, (small, crate)) == [
        m.RemoveObstacle("ball"),
        m.AddObstacle(small),
        m.AddObstacle(crate),
    ]
    assert changes(before, ()) == [m.RemoveObstacle("ball")]


def test_a_box_has_twelve_edges() -> None:
    edges = box_edges(np.array([0.2, 0.4, 0.6]))
    assert edges.shape == (12, 2, 3)
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    np.testing.assert_allclose(np.sort(lengths), np.repeat([0.2, 0.4, 0.6], 4), rtol=1e-6)
    np.testing.assert_allclose(np.abs(edges).max(axis=(0, 1)), [0.1, 0.2, 0.3], rtol=1e-6)
