"""What the page computes by itself: surfaces, ellipsoids, colours, throws and recordings; no browser."""

from __future__ import annotations

import contextlib
import io
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sidestep import Body, ExactClearance, Obstacles, Robot, Scenario
from sidestep.math.pose import pose_at
from sidestep.studio import messages as m
from sidestep.studio.adapter import ControllerAdapter
from sidestep.studio.clearance_monitor import ExactClearanceMonitor, solid_poses
from sidestep.studio.methods import METHODS
from sidestep.studio.page import colours, obstacle_panel
from sidestep.studio.page import surface as surface_module
from sidestep.studio.page.arm import reach, short_names
from sidestep.studio.page.camera import HALF, HIGH, LOW, RIGHT, UNDER_CORNER, UP, VIEW, Viewpoint
from sidestep.studio.page.marks import GAP, METRIC_SIZE, Marks, metric_ellipsoid
from sidestep.studio.page.obstacle_panel import ObstaclePanel
from sidestep.studio.page.obstacles import FASTEST_THROW, throw_velocity
from sidestep.studio.page.plots import Plots
from sidestep.studio.page.recorder import Recorder, as_npz
from sidestep.studio.page.surface import (
    CELLS,
    SIDE,
    TOP,
    Request,
    Surface,
    heights_over,
    labels,
    net,
    on_surface,
    open_faces,
    seen,
)
from sidestep.studio.page.view import begins_anew, live_row
from sidestep.studio.page.words import begun
from sidestep.studio.scene_obstacle import ball, cloud, thing_of
from sidestep.studio.session import Session
from sidestep.studio.systems import build_adapter

MakeSession = Callable[..., Session]


def test_the_surface_is_the_embedding_over_two_joints(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    snapshot, robot = session.snapshot(), session.robot
    method, body = METHODS["unswitched"], Body.fit(robot, components=1)
    numbers = method.defaults
    system = build_adapter(method, robot, body, numbers, scenario).system
    points, radii = seen(snapshot, bare=True)
    np.testing.assert_array_equal(points, session._obstacles().points)
    np.testing.assert_array_equal(radii, session._obstacles().radii)
    request = Request(
        robot, body, method, numbers, (0, 1), snapshot.q, points, radii, scenario, snapshot.activations
    )
    heights = heights_over(request, system)
    axis = np.linspace(-np.pi, np.pi, CELLS + 1)  # planar2 turns from -pi to pi
    q = axis[[35, 22]]
    psi = system.acceleration(q, np.zeros(2), q, Obstacles(points, radii)).values
    assert heights[35, 22] == pytest.approx(abs(psi[0]), rel=1e-12)
    place = on_surface(robot, (0, 1), q, heights)
    scale = SIDE / (2.0 * np.pi)
    np.testing.assert_allclose(
        place, [q[0] * scale, q[1] * scale, min(heights[35, 22] * scale, TOP)], atol=1e-12
    )


def test_the_surface_is_of_the_system_that_the_loop_runs(
    make_session: MakeSession, scenario: Scenario
) -> None:
    """Barriers that leave the goal free while obstacles are at rest, and do not while one may come near the arm."""
    session = make_session(scenario, method="reactive")
    goal = session.snapshot().goal
    assert goal is not None
    place = session.robot.pose(goal, session.tip)
    place[1, 3] += 0.16  # [m] the goal lies within the activation distance
    session.handle(m.SetRunning(False))
    session.handle(m.DragObstacle("ball", place))
    body, method = Body.cover(session.robot, components=2), METHODS["reactive"]
    axis, rest = np.linspace(-np.pi, np.pi, CELLS + 1), np.zeros(2)
    cell = [int(np.abs(axis - angle).argmin()) for angle in goal]
    q = axis[cell]  # of the grid, next to the goal
    found = []
    for velocity in (0.0, 2.0):  # [m/s] with which it could be at the arm in a second
        session.handle(m.ThrowObstacle("ball", np.array([0.0, velocity, 0.0])))
        now = session.snapshot()
        system = build_adapter(
            method, session.robot, body, now.numbers["reactive"], scenario, synchronous=True
        ).system
        request = Request(
            session.robot,
            body,
            method,
            now.numbers["reactive"],
            (0, 1),
            now.q,
            *seen(now, bare=False),
            scenario,
            now.activations,
        )
        height = heights_over(request, system)[cell[0], cell[1]]
        obstacles = session._obstacles()
        assert isinstance(session._adapter, ControllerAdapter)
        controller = session._adapter._said  # at rest where it is, to the goal
        assert controller is not None
        psi = controller.system.acceleration(q, rest, q, obstacles, controller.activations).values
        assert height == pytest.approx(np.linalg.norm(psi), rel=1e-12)
        found.append((height, request))
    assert 2.0 * found[0][0] < found[1][0]
    assert found[1][1].differs(found[0][1])


def test_the_axes_of_the_surface_are_named_and_have_values() -> None:
    texts = {name: text for name, (text, _, _) in labels(Robot.named("planar2"), (0, 1)).items()}
    assert texts == {
        "label0-1": "-180°",
        "label0+0": "joint1",
        "label0+1": "180°",
        "label1-1": "-180°",
        "label1+0": "joint2",
        "label1+1": "180°",
        "label2+0": "0",
        "label2+1": "ψ = 1.6",  # 0.3 m where 1.2 m are 2 pi
    }


def test_the_net_lies_on_the_surface_where_it_is_not_cut_off() -> None:
    z = np.zeros((13, 13))
    assert len(net(z)) == 2 * 13 * 12
    assert net(z)[..., 2].max() < 0.01
    z[6, 6] = TOP
    assert len(net(z)) == 2 * 13 * 12 - 4  # two lines of each joint end there


def test_the_surface_is_open_where_it_is_cut_off() -> None:
    z = np.zeros((3, 4))
    assert len(open_faces(z)) == 2 * 2 * 3
    assert open_faces(z).max() == 11
    z[0, 0] = TOP  # a corner, of both triangles of its cell
    faces = open_faces(z)
    assert len(faces) == 2 * 2 * 3 - 2
    assert 0 not in faces


def test_a_surface_is_computed_again_only_when_it_would_look_different(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario, method="unswitched")
    snapshot, method = session.snapshot(), METHODS["unswitched"]
    body = Body.fit(session.robot, components=1)

    def request(q: np.ndarray, points: np.ndarray) -> Request:
        radii = np.zeros(len(points))
        return Request(
            session.robot,
            body,
            method,
            method.defaults,
            (0, 1),
            q,
            points,
            radii,
            scenario,
            snapshot.activations,
        )

    points = seen(snapshot, bare=True)[0]
    first = request(snapshot.q, points)
    assert first.differs(None)
    assert not request(snapshot.q + 0.5, points).differs(first)  # both joints are drawn: none is held
    assert request(snapshot.q, points + 0.01).differs(first)


def test_the_metric_of_flat_space_is_drawn_at_full_size() -> None:
    robot = Robot.named("planar3")
    q = np.array([0.3, 0.5, -0.4])
    pose, axes = metric_ellipsoid(robot, "tip", q, np.eye(3))
    assert axes.max() == pytest.approx(METRIC_SIZE * reach(robot), rel=1e-9)
    np.testing.assert_allclose(pose[:3, 3], robot.pose(q, "tip")[:3, 3])
    _, smaller = metric_ellipsoid(robot, "tip", q, 4.0 * np.eye(3))
    assert smaller.max() == pytest.approx(0.5 * METRIC_SIZE * reach(robot), rel=1e-9)  # G = 4: half the speed


def test_a_trail_is_not_drawn_over_a_time_that_nobody_saw() -> None:
    robot = Robot.named("planar2")
    scene = SimpleNamespace(
        add_line_segments=lambda *_, **__: SimpleNamespace(points=None, visible=False),
        add_mesh_simple=lambda *_, **__: None,
    )
    marks = Marks(SimpleNamespace(scene=scene), robot, "tip")  # type: ignore[arg-type]
    at = [0.0, 0.1, 0.2, 0.2 + 2.0 * GAP, 0.3 + 2.0 * GAP]  # [s]
    ways = [np.array([time, 0.0]) for time in at]  # 1 rad/s
    tips = [robot.pose(q, "tip")[:3, 3] for q in ways]
    for time, q in zip(at, ways, strict=True):
        marks.show_trail(q, time, visible=True)
    drawn = [[tips[0], tips[1]], [tips[1], tips[2]], [tips[3], tips[4]]]
    np.testing.assert_allclose(marks.trail.points, drawn, atol=1e-6)  # single precision
    marks.show_trail(ways[-1], at[-1] + 2.0 * GAP, visible=True)  # it rests
    np.testing.assert_allclose(marks.trail.points, drawn, atol=1e-6)


def test_a_window_shows_arm_goal_and_obstacles_and_the_surface_beside_them() -> None:
    rng = np.random.default_rng(0)
    for size in (0.1, 1.0, 3.0):
        places = size * rng.uniform(-1.0, 1.0, (12, 3)) * [1.0, 0.5, 0.3] + [0.5, 0.0, 0.3]
        view = Viewpoint.of(places, high=UNDER_CORNER)

        def seen(points: np.ndarray, view: Viewpoint = view) -> np.ndarray:
            away = points - view.position
            return away @ np.array([RIGHT, UP]).T / (HALF * (away @ VIEW)[:, None])

        found = seen(places)
        assert (found > LOW - 0.02).all()  # found by rounds, up to some thousandths
        assert (found < UNDER_CORNER + 0.02).all()
        pose = view.corner(SIDE)
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        square = np.array([[x, y, 0.0] for x in (-0.5, 0.5) for y in (-0.5, 0.5)]) * SIDE
        corners = pose[:3, 3] + square @ pose[:3, :3].T
        inside = seen(corners)
        assert (inside[:, 0] > -0.77).all()  # half the width that 1280 x 800 leaves between the panels
        assert (inside[:, 1] < 1.0).all()
        assert (inside[:, 1] > UNDER_CORNER[1]).all()  # above the arm
        assert ((corners - view.position) @ VIEW > 0.5 * view.far).all()
        assert pose[:3, 2] @ (view.position - pose[:3, 3]) > 0.0  # its upper side is seen
        near = Viewpoint.of(places)  # without the surface they are larger, and fill the window
        found = seen(places, near)
        assert (found > LOW - 0.02).all()
        assert (found < HIGH + 0.02).all()
        assert ((np.ptp(found, axis=0) / (HIGH - LOW)).max()) > 0.97


def test_joints_are_named_by_what_tells_them_apart() -> None:
    assert short_names(["fr3_joint1", "fr3_joint2"]) == ["joint1", "joint2"]
    assert short_names(["shoulder_pan_joint", "elbow_joint", "wrist_1_joint"]) == [
        "shoulder_pan",
        "elbow",
        "wrist_1",
    ]
    assert short_names(["lbr_joint_1", "lbr_joint_2"]) == ["joint_1", "joint_2"]
    assert short_names(["lift"]) == ["lift"]


def test_the_colours_of_batched_meshes_are_shown_as_those_of_others() -> None:
    assert colours.batched((255, 255, 255)) == (255, 255, 255)
    assert colours.batched((0, 0, 0)) == (0, 0, 0)
    assert colours.batched((128, 128, 128)) == (55, 55, 55)  # ((128/255 + 0.055) / 1.055)^2.4 = 0.216


def test_the_ball_of_a_cloud_that_is_touched_is_named_by_the_cloud(tmp_path: Path) -> None:
    np.save(tmp_path / "wall.npy", np.zeros((2, 3)))
    things = [cloud("wall", np.zeros(3), tmp_path / "wall.npy", 0.01), ball("a.b", np.zeros(3), 0.1)]
    assert thing_of("wall.1", things) == "wall"
    assert thing_of("a.b", things) == "a.b"


def test_an_unknown_clearance_does_not_empty_its_plot(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    server = SimpleNamespace(
        gui=SimpleNamespace(
            add_uplot=lambda *_, **__: SimpleNamespace(data=None), add_html=lambda *_, **__: None
        )
    )
    plots = Plots(server)  # type: ignore[arg-type]
    plots.add(session.snapshot(), 0.4)
    assert len(plots.rows) == 0  # no step yet
    for clearance in (np.inf, 0.3, 0.2):
        session.step()
        plots.add(session.snapshot(), clearance)
    plots.draw(1.0)
    times, values = plots._handles[0].data
    np.testing.assert_allclose(times, [-0.001, 0.0], atol=1e-12)
    np.testing.assert_allclose(values, [300.0, 200.0])  # [mm]
    assert len(plots._handles[1].data[0]) == 3


def test_plots_do_not_join_what_lies_on_both_sides_of_a_time_that_nobody_saw(
    make_session: MakeSession, scenario: Scenario
) -> None:
    gui = SimpleNamespace(
        add_uplot=lambda *_, **__: SimpleNamespace(data=None), add_html=lambda *_, **__: None
    )
    plots = Plots(SimpleNamespace(gui=gui))  # type: ignore[arg-type]
    session = make_session(scenario, method="unswitched")
    session.step()
    snapshot = session.snapshot()
    for time in (0.0, 0.1, 0.2 + GAP, 0.3 + GAP):
        plots.add(replace(snapshot, time=time), 0.4)
    plots.draw(1.0)
    np.testing.assert_allclose(plots._handles[0].data[0], [-0.1, 0.0], atol=1e-12)
    assert len(plots.rows) == 4
    plots.draw_past(2.0, [tuple(row) for row in plots.rows], 0.1)
    np.testing.assert_allclose(plots._handles[0].data[0], [-0.1, 0.0], atol=1e-12)  # before it


def test_links_change_colour_towards_contact() -> None:
    assert colours.shade(np.inf) == colours.shade(colours.NEAR_FROM) == 0
    assert colours.shade(-0.01) == colours.shade(0.0) == colours.SHADES
    assert colours.shade_colour(0) == colours.rgb(colours.LINK)
    assert colours.shade_colour(colours.SHADES) == colours.rgb(colours.NEAR)
    used = [colour for colour, _ in colours.LEGEND]
    assert len(set(used)) == len(used)  # each means one thing
    assert {colours.BASE, colours.RIM} <= set(used)  # and all are explained


def test_a_throw_has_the_speed_of_the_hand_up_to_a_limit() -> None:
    path = [(0.0, np.zeros(3)), (0.1, np.array([0.05, 0.0, 0.0]))]
    np.testing.assert_allclose(throw_velocity(path), [0.5, 0.0, 0.0])
    fast = [(0.0, np.zeros(3)), (0.1, np.array([0.0, 3.0, 0.0]))]
    np.testing.assert_allclose(throw_velocity(fast), [0.0, FASTEST_THROW, 0.0])
    np.testing.assert_array_equal(throw_velocity(path[:1]), np.zeros(3))


def test_a_recording_keeps_time_motion_and_obstacles(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    session.handle(m.SetRecording(True))
    for _ in range(100):
        session.step()
    rows = list(session.snapshot().rows)
    session.handle(m.RemoveObstacle("ball"))
    for _ in range(100):
        session.step()
    rows += session.snapshot().rows
    kept = np.load(io.BytesIO(as_npz(rows)))
    np.testing.assert_allclose(kept["time"], 0.005 * np.arange(1, 41), atol=1e-12)
    assert kept["q"].shape == (40, 2)
    assert list(kept["names"]) == ["ball"]
    np.testing.assert_array_equal(kept["poses"][0, 0], rows[0].poses[0])
    assert np.isnan(kept["poses"][20:]).all()  # it was gone


def test_the_nearest_of_each_link_agrees_with_the_nearest_of_all(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario, method="unswitched")
    session.handle(m.DragObstacle("ball", pose_at([0.5, 0.4, 0.0])))
    for _ in range(500):
        session.step()
    snapshot = session.snapshot()
    exact = ExactClearance(session.robot, [solid for thing in snapshot.things for solid in thing.solids])
    poses = solid_poses(snapshot.things, snapshot.poses)
    each = exact.of_links(snapshot.q, poses)
    assert [item.link for item in each] == ["link1", "link2"]
    assert min(item.distance for item in each) == exact.distance(snapshot.q, poses).distance


PATIENCE = 60.0  # [s] at most for a thread to do a step


def test_a_measurement_that_fails_is_reported_and_the_next_one_is_made(
    make_session: MakeSession, scenario: Scenario
) -> None:
    session = make_session(scenario, method="unswitched")
    row = live_row(session.snapshot())
    bad = m.Row(row.time, np.zeros(5), row.things, row.poses, row.metric)  # five joints of two
    reported: list[tuple[str, Exception]] = []
    found: list[Any] = []
    heard = threading.Event()

    def report(what: str, error: Exception) -> None:
        reported.append((what, error))
        heard.set()

    def tell(*answer: object) -> None:
        found.append(answer)
        heard.set()

    truth = ExactClearanceMonitor(tell, report)
    truth.look(session.robot, bad, 1)
    assert heard.wait(PATIENCE)
    assert not found
    assert reported[0][0] == "measuring clearances failed"
    heard.clear()
    truth.look(session.robot, row, 2)
    assert heard.wait(PATIENCE)
    truth.stop()
    assert len(reported) == 1
    ((clearances, time, epoch),) = found
    exact = ExactClearance(session.robot, [solid for thing in row.things for solid in thing.solids])
    assert (time, epoch) == (row.time, 2)
    assert clearances[0].distance == exact.distance(row.q, solid_poses(row.things, row.poses)).distance


def test_a_surface_that_cannot_be_computed_is_reported_and_the_next_one_is(
    make_session: MakeSession, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session(scenario, method="unswitched")
    body, drawn, heard = Body.fit(session.robot, components=1), [], threading.Event()
    reported: list[tuple[str, Exception]] = []

    def report(what: str, error: Exception) -> None:
        reported.append((what, error))
        heard.set()

    def draw(_: Surface, __: Request, heights: np.ndarray) -> None:
        drawn.append(heights)
        heard.set()

    def fail(*_: object) -> None:
        raise RuntimeError("no room")

    monkeypatch.setattr(Surface, "_show_surface", draw)
    monkeypatch.setattr(Surface, "_show_state", lambda *_: None)
    monkeypatch.setattr(surface_module, "CELLS", 4)
    surface = Surface(None, threading.RLock(), report)  # type: ignore[arg-type]
    place = Viewpoint.of(np.eye(3))
    with monkeypatch.context() as patch:
        patch.setattr(surface_module, "heights_over", fail)
        surface.show(session.snapshot(), session.robot, body, (0, 1), place)
        assert heard.wait(PATIENCE)
    assert surface.heights is None
    ((what, error),) = reported
    assert (what, str(error)) == ("computing the curved space failed", "no room")
    heard.clear()
    session.handle(m.SetRunning(False))
    session.handle(m.DragObstacle("ball", pose_at([0.6, 0.5, 0.0])))
    surface.show(session.snapshot(), session.robot, body, (0, 1), place)
    assert heard.wait(PATIENCE)
    surface.stop()
    assert len(reported) == 1
    np.testing.assert_array_equal(surface.heights, drawn[0])
    assert drawn[0].shape == (5, 5)


def test_the_slice_of_an_arm_of_many_joints_is_taken_where_the_others_are(
    make_session: MakeSession, scenario: Scenario
) -> None:
    """Joints 2 and 3 of three, with names and ends of the axes, and told apart from a slice elsewhere."""
    robot = Robot.named("planar3")
    body, method, numbers = (
        Body.fit(robot, components=1),
        METHODS["unswitched"],
        METHODS["unswitched"].defaults,
    )
    system = build_adapter(method, robot, body, numbers, scenario).system
    points, radii = np.array([[0.8, 0.3, 0.0]]), np.zeros(1)

    def request(q: np.ndarray, joints: tuple[int, int] = (1, 2)) -> Request:
        return Request(robot, body, method, numbers, joints, q, points, radii, scenario, np.zeros(0))

    here = np.array([0.4, -0.2, 0.9])
    slices = request(here)
    heights = heights_over(slices, system)
    axis, rest = np.linspace(-np.pi, np.pi, CELLS + 1), np.zeros(3)
    for i, k in ((30, 30), (28, 37), (12, 50)):
        q = np.array([0.4, axis[i], axis[k]])
        psi = system.acceleration(q, rest, q, Obstacles(points, radii)).values
        assert heights[i, k] == pytest.approx(np.linalg.norm(psi), rel=1e-12)
    np.testing.assert_array_equal(heights, heights_over(request(np.add(here, [0.0, 0.3, 0.2])), system))
    elsewhere = request(np.add(here, [0.5, 0.0, 0.0]))
    assert elsewhere.differs(slices)
    assert np.abs(heights_over(elsewhere, system) - heights).max() > 0.1 * heights.max()
    swapped = heights_over(request(here, (2, 1)), system)
    np.testing.assert_array_equal(swapped, heights.T)
    place = on_surface(robot, (1, 2), here, heights)
    np.testing.assert_allclose(place[:2], here[1:] * SIDE / (2.0 * np.pi), atol=1e-12)
    texts = {name: text for name, (text, _, _) in labels(robot, (1, 2)).items()}
    assert (texts["label0+0"], texts["label1+0"]) == ("joint2", "joint3")


def test_a_sentence_begins_large_but_a_name_stays_as_it_is() -> None:
    assert begun("on the way, 0.3 rad from the goal") == "On the way, 0.3 rad from the goal"
    assert begun("fr3_link5 slides along ball3, 53 mm away") == "fr3_link5 slides along ball3, 53 mm away"
    assert begun("planner: idle; arriving") == "Planner: idle; arriving"


def test_live_lets_the_loop_go_on_only_if_it_ran(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    sent: list[m.Command] = []
    control = SimpleNamespace(on_click=lambda _: None, on_update=lambda _: None, content="", value=0.0)
    names = "add_button_group", "add_slider", "add_button", "add_markdown", "add_html"
    gui = SimpleNamespace(**dict.fromkeys(names, lambda *_, **__: control))
    view = SimpleNamespace(send=sent.append, last=None, telling=lambda _: contextlib.nullcontext())
    recorder = Recorder(SimpleNamespace(gui=gui), view)  # type: ignore[arg-type]
    recorder.take([live_row(session.snapshot())] * 2)

    def press(*names: str) -> list[bool]:
        sent.clear()
        for name in names:
            view.last = session.snapshot()
            recorder._on_replay(SimpleNamespace(target=SimpleNamespace(value=name), client=None))
            for command in sent:
                session.handle(command)
        return [command.running for command in sent if isinstance(command, m.SetRunning)]

    assert press("Play", "Play", "Live") == [False, False, True]  # it ran before the first
    assert press("Live") == []
    session.handle(m.SetRunning(False))
    assert press("Play", "Live") == [False]


def test_the_least_clearance_is_of_one_motion(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario, method="unswitched")
    first = session.snapshot()
    session.handle(m.Restart())
    assert begins_anew(first, session.snapshot())
    session.step()
    before = session.snapshot()
    session.handle(m.RemoveObstacle("ball"))
    session.step()
    assert not begins_anew(before, session.snapshot())  # an obstacle less, and the same motion
    session.handle(m.Restart())
    assert begins_anew(before, session.snapshot())


def test_the_place_of_an_obstacle_that_flies_is_followed(
    make_session: MakeSession, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session(scenario, method="unswitched")
    panel = ObstaclePanel.__new__(ObstaclePanel)
    view, now = SimpleNamespace(last=session.snapshot()), [10.0]
    monkeypatch.setattr(obstacle_panel, "clock", SimpleNamespace(monotonic=lambda: now[0]))
    vars(panel).update(
        _loop=view,
        _chosen=SimpleNamespace(value="ball"),
        _place=SimpleNamespace(value=None),
        _box=SimpleNamespace(visible=False),
        _shown=("", 0.0, 0.0, 0.0),
        _followed=0.0,
    )
    panel.follow(view.last)
    session.handle(m.ThrowObstacle("ball", np.array([0.0, 0.5, 0.0])))
    shown = []
    for _ in range(4):
        for _ in range(100):
            session.step()
        now[0] += 0.15  # [s] of which 0.2 are to pass
        view.last = session.snapshot()
        panel.follow(view.last)
        shown.append(np.allclose(panel._place.value, view.last.poses[0][:3, 3], atol=6e-4))  # of 1 mm
    assert shown == [False, True, False, True]
