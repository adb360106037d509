"""A run of one's own, read from its recording: arrays, clearances by link, events, page, picture and table."""

import csv
import json

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import sidestep as ss
from sidestep.cli import app
from sidestep.obstacles import Box

Q = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785])
STEPS = 400


def at(x, y, z):
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


@pytest.fixture(scope="module")
def arm():
    return ss.Arm.load("fr3")


@pytest.fixture(scope="module")
def made(arm, tmp_path_factory):
    """A motion past a box and a ball that moves: its steps, the obstacles of each, and the recording."""
    path = tmp_path_factory.mktemp("recordings") / "run.mcap"
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, output="torque"))
    rows, q, v = [], Q, np.zeros(7)
    with controller.record(path):
        controller.set_obstacles([Box((0.2, 0.2, 0.2), pose=at(0.55, 0.35, 0.4), name="box")])
        ball = ss.Obstacles([[0.5, -0.6, 0.6]], radii=0.05, velocities=[[0.0, 0.3, 0.0]])
        for k in range(STEPS):
            if k == 40:
                controller.set_obstacles(ball, source="tracker", time=2.0 + 0.001 * k, valid_for=10.0)
            if k == 100:
                controller.set_goal(Q + np.array([0.7, 0.2, 0, 0.2, 0, 0, 0]))
            if k == 300:
                controller.set_twist("fr3_hand", [0.05, 0, 0, 0, 0, 0])
            command = controller.step(q, v, time=2.0 + 0.001 * k)
            rows.append((q, v, command, controller.obstacles))
            v = v + 0.001 * command.acceleration
            q = q + 0.001 * v
    return rows, path


@pytest.fixture(scope="module")
def run(made):
    return ss.load_recording(made[1])


def test_the_arrays_are_those_of_the_steps(made, run):
    rows, _ = made
    assert (len(run), run.complete, run.lost, run.damage, run.whole) == (STEPS, True, 0, "", True)
    np.testing.assert_array_equal(run.q, [row[0] for row in rows])
    np.testing.assert_array_equal(run.v, [row[1] for row in rows])
    for name in ("position", "velocity", "acceleration", "wanted", "torque", "torque_without_gravity"):
        np.testing.assert_array_equal(getattr(run, name), [getattr(row[2], name) for row in rows], name)
    for name in ("clearance", "tracking_error", "speed", "speed_limit"):
        np.testing.assert_array_equal(getattr(run, name), [getattr(row[2], name) for row in rows], name)
    assert list(run.status) == [row[2].status.name for row in rows]
    assert list(run.activity) == [row[2].activity.name for row in rows]
    np.testing.assert_allclose(run.time, 2.0 + 0.001 * np.arange(STEPS), atol=1e-9)
    assert run.duration == pytest.approx(0.399)
    assert run.joint_names == tuple(f"fr3_joint{k}" for k in range(1, 8))
    with pytest.raises(ValueError, match="read-only"):
        run.q[0, 0] = 1.0


def test_what_is_nearest_is_what_the_controller_said(made, run, arm):
    rows, _ = made
    labels = ss.Controller(arm, run.settings).labels
    near = 0
    for k, (_, _, command, obstacles) in enumerate(rows):
        if command.coordinate < 0:
            assert run.link[k] == run.nearest[k] == ""
            continue
        label = labels[command.coordinate]
        assert run.link[k] == label.name
        if command.point >= 0:
            other = obstacles.name_of(command.point) or "a point of 'tracker'"
            assert run.nearest[k].startswith(f"link '{label.name}' and ")
            assert other.strip("'") in run.nearest[k]
            near += 1
    assert near > 100


def test_clearances_by_link_are_those_of_the_query_at_the_obstacles_of_that_step(made, run):
    """The obstacles are moved on as the controller moved them: checked against what it used."""
    from sidestep._core import PathPlanner

    rows, _ = made
    query = PathPlanner(run.arm.robot, run.arm.body)  # without pairs: of the obstacles alone
    assert run.links[-1] == "the arm itself"
    assert len(run.link_time) == 20
    for k, moment in enumerate(run.link_time):
        step = round((moment - 2.0) / 0.001)
        q, _, _, obstacles = rows[step]
        least = query.clearance(q, obstacles, cap=0.5).clearance
        expected = least if least < 0.5 else np.inf
        assert np.min(run.link_clearance[k, :-1]) == pytest.approx(expected, abs=1e-12)
    assert np.isfinite(run.link_clearance[:, -1]).any()


def test_the_events_tell_requests_activities_and_statuses_in_words(run):
    requests = [(event.step, event.words) for event in run.events if event.kind == "request"]
    assert requests == [(100, "a joint goal"), (300, "a twist of 'fr3_hand'")]
    activities = [(event.step, event.words) for event in run.events if event.kind == "activity"]
    assert activities[:2] == [(0, "no goal"), (100, "moving")]
    assert [event.step for event in run.events] == sorted(event.step for event in run.events)
    assert all(event.time == run.time[event.step] for event in run.events)
    limited = next(k for k in range(STEPS) if run.status[k] == "limited")
    assert run.explain(limited).startswith("limited: changed by a limit or a clearance; ")
    with pytest.raises(IndexError):
        run.explain(STEPS)


def test_the_page_has_its_parts_and_the_picture_is_not_empty(run, tmp_path):
    page = run.plot(tmp_path / "run.html").read_text(encoding="utf-8")
    for part in (
        "Status and activity",
        "Clearance of each link",
        "Commanded torque",
        "What happened",
        "a joint goal",
    ):
        assert part in page
    assert page.count("data:image/png;base64,") == 4
    picture = np.asarray(Image.open(run.plot(tmp_path / "run.png")).convert("L"))
    assert picture.shape[1] > 900
    assert 0.005 < np.mean(picture < 250) < 0.6
    with pytest.raises(ValueError, match=r"the suffix is '\.pdf', allowed: \.png, \.html"):
        run.plot(tmp_path / "run.pdf")


def test_the_table_has_a_row_for_each_step(made, run, tmp_path):
    with run.save_csv(tmp_path / "run.csv").open(encoding="utf-8", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert len(table) == STEPS
    _, _, command, _ = made[0][200]
    assert float(table[200]["torque fr3_joint2 [N m]"]) == pytest.approx(command.torque[1], rel=1e-8)
    assert float(table[200]["time [s]"]) == pytest.approx(2.2)
    assert table[200]["activity"] == "moving"
    assert table[200]["link"] == run.link[200]


def test_the_command_writes_page_table_and_figures(made, tmp_path):
    path = made[1]
    arguments = ["report", str(path), "-o", str(tmp_path / "page.html"), "--csv", str(tmp_path / "run.csv")]
    done = CliRunner().invoke(app, [*arguments, "--json", str(tmp_path / "figures.json")])
    assert done.exit_code == 0, done.output
    assert "largest torque / limit" in done.output
    assert (tmp_path / "page.html").stat().st_size > 50_000
    assert (tmp_path / "run.csv").read_text("utf-8").count("\n") == STEPS + 1
    document = json.loads((tmp_path / "figures.json").read_text("utf-8"))
    assert (document["steps"], document["complete"], document["damage"]) == (STEPS, True, None)
    done = CliRunner().invoke(app, ["report", str(path), "-q"])
    assert (done.exit_code, done.output) == (0, "")
    assert path.with_suffix(".html").exists()


def test_a_recording_that_was_cut_off_or_damaged_is_read_up_to_there(made, tmp_path):
    data = bytearray(made[1].read_bytes())
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) // 2])
    run = ss.load_recording(cut)
    assert 100 < len(run) < STEPS
    assert not run.complete
    assert run.damage == ""
    data[3 * len(data) // 4] ^= 1
    flipped = tmp_path / "flipped.mcap"
    flipped.write_bytes(data)
    run = ss.load_recording(flipped)
    assert 200 < len(run) < STEPS
    assert "are not those that were written" in run.damage
    done = CliRunner().invoke(app, ["report", str(flipped)])
    assert done.exit_code == 1


def test_recordings_without_steps_or_obstacles_are_drawn(tmp_path):
    controller = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True))
    with controller.record(tmp_path / "empty.mcap"):
        pass
    run = ss.load_recording(tmp_path / "empty.mcap")
    assert (len(run), run.duration, run.events) == (0, 0.0, ())
    run.plot(tmp_path / "empty.html")
    controller = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True))
    with controller.record(tmp_path / "blind.mcap"):
        controller.step([0.1, 0.2], [0.0, 0.0])
    run = ss.load_recording(tmp_path / "blind.mcap")
    assert list(run.status) == ["stale"]
    run.plot(tmp_path / "blind.png")
