"""Recordings of steps: a replay gives the same commands bit for bit, or names the first that differs."""

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader
from typer.testing import CliRunner

import sidestep as ss
from sidestep.cli import app
from sidestep.controller import (
    BarrierSettings,
    JointGoal,
    LookAheadSettings,
    read_recording_header,
)
from sidestep.loop import Loop
from sidestep.obstacles import Box, Cylinder
from support.busy_machine import PATIENT
from support.mcap_bytes import FRAME, MESSAGE, messages, sign

Q = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785])
FINGERS = ["fr3_leftfinger", "fr3_rightfinger"]
BEFORE_Q = FRAME + MESSAGE + 20  # [B] in the record of a step: its number, time, size of q


@pytest.fixture(scope="module")
def arm():
    return ss.Arm.load("fr3")


def controller_of(arm, **settings):
    made = ss.Controller(arm, ss.ControllerSettings(synchronous=True, **settings))
    made.set_obstacles(ss.Obstacles.none())
    return made


def at(x, y, z):
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def balls(shift=0.0):
    points = np.array([[0.45, 0.2, 0.5], [0.5, -0.25, 0.4], [0.3, 0.4 - shift, 0.5]])
    return ss.Obstacles(points, radii=0.05, velocities=[[0.0] * 3, [0.0] * 3, [0.0, -0.2, 0.0]])


def moved(controller, q, v, steps):
    """Moves a robot that does what it is told."""
    follows = controller.settings.output.name in ("position", "velocity")
    for _ in range(steps):
        command = controller.step(q, v)
        if follows:
            q, v = command.position, command.velocity
        else:
            v = v + 0.001 * command.acceleration
            q = q + 0.001 * v
    return q, v


def drive(controller):
    """Every kind of request; returns how many steps it took."""
    robot = controller.arm.robot
    q, v = Q, np.zeros(7)
    times = np.array([0.05, 0.1, 0.15, 0.2])
    requests = [
        lambda: controller.set_obstacles(balls()),
        lambda: controller.set_goal(Q + 0.3),
        lambda: controller.set_goal(ss.PoseGoal(robot, "fr3_hand", robot.pose(Q + 0.2, "fr3_hand"))),
        lambda: controller.set_obstacles([Box((0.2, 0.2, 0.2), pose=at(0.5, 0.5, 0.3), name="box")]),
        lambda: controller.set_velocity(np.full(7, 0.3)),
        lambda: controller.set_twist("fr3_hand", [0.1, 0.0, -0.1, 0.0, 0.2, 0.0], local=True),
        lambda: controller.set_trajectory(q + 0.1 * times[:, None], times),
        lambda: controller.set_trajectory(q - 0.1 * times[:, None], times, "steer"),
        lambda: controller.set_goal(JointGoal(q, velocity=np.full(7, 0.05))),
        lambda: controller.set_goal(
            ss.PoseGoal(robot, "fr3_hand", robot.pose(q, "fr3_hand"), twist=[0.1] * 6)
        ),
        controller.clear_goal,
        lambda: controller.set_obstacles(balls(0.1)),
    ]
    for request in requests:
        request()
        q, v = moved(controller, q, v, 40)
    return 40 * len(requests)


@pytest.fixture(scope="module")
def recorded(arm, tmp_path_factory):
    """A recording of `drive`, and its number of steps."""
    path = tmp_path_factory.mktemp("recordings") / "drive.mcap"
    controller = controller_of(arm)
    with controller.record(path) as recording:
        steps = drive(controller)
    summary = recording.stop()
    assert (summary.steps, summary.lost, summary.bytes) == (steps, 0, path.stat().st_size)
    return path, steps


def step_records(data):
    return messages(data, "/sidestep/step")


def assert_equal(result, steps):
    assert result.difference is None
    assert result.damage == ""
    assert result.equal
    assert result.complete
    assert (result.steps, result.lost, result.notes) == (steps, 0, [])


@pytest.mark.parametrize("output", ["acceleration", "torque", "position", "velocity"])
def test_a_replay_of_every_kind_of_request_gives_the_same_commands(arm, tmp_path, output):
    path = tmp_path / "drive.mcap"
    controller = controller_of(arm, output=output)
    with controller.record(path):
        steps = drive(controller)
    assert_equal(ss.replay(path), steps)


def test_what_was_set_before_the_recording_began_is_in_it(arm, tmp_path):
    controller = controller_of(arm)
    controller.set_obstacles(balls())
    controller.set_goal(Q + 0.3)
    with controller.record(tmp_path / "run.mcap"):
        moved(controller, Q, np.zeros(7), 50)
    assert_equal(ss.replay(tmp_path / "run.mcap"), 50)


def test_mass_matrices_and_unusable_states(arm, tmp_path):
    controller = controller_of(arm, output="torque")
    q, v = Q, np.zeros(7)
    with controller.record(tmp_path / "run.mcap"):
        controller.set_goal(Q + 0.2)
        for k in range(60):
            seen = np.full(7, np.nan) if k == 20 else q
            mass = 1.1 * arm.mass_matrix(q)
            command = controller.step(seen, v, mass, arm.bias(q, v)) if k % 3 else controller.step(seen, v)
            v = v + 0.001 * command.acceleration
            q = q + 0.001 * v
    assert_equal(ss.replay(tmp_path / "run.mcap"), 60)


def test_a_restart_and_a_pause_by_the_clock(arm, tmp_path):
    """What a step reads of the machine's clock is an input: a replay has no pause, and begins anew all the same."""
    path = tmp_path / "run.mcap"
    controller = controller_of(arm, output="position")
    controller.set_obstacles(ss.Obstacles.none())
    with controller.record(path):
        controller.set_goal(Q + 0.2)
        q, v = moved(controller, Q, 0.0 * Q, 200)
        time.sleep(0.15)  # meanwhile something else moves the arm
        q = q + 0.3
        command = controller.step(q, 0.0 * q)
        np.testing.assert_allclose(command.position, q, atol=1e-3)  # it begins there
        q, v = moved(controller, command.position, command.velocity, 100)
        controller.restart()
        q, v = moved(controller, q, v, 100)
        controller.set_twist("fr3_hand", [0.0, 0.0, 0.1, 9.0, 9.0, 9.0], free="rotation")
        moved(controller, q, v, 100)
    result = ss.replay(path)
    assert result.equal, result.difference
    assert result.steps == 501


def test_obstacles_that_moved_before_they_were_set(arm, tmp_path):
    rng = np.random.default_rng(1)
    cloud = ss.Obstacles(
        rng.uniform(-1.0, 1.0, (500, 3)), radii=0.01, velocities=rng.normal(0, 0.5, (500, 3))
    )
    cloud.advance(2.0)
    controller = controller_of(arm)
    with controller.record(tmp_path / "run.mcap"):
        controller.set_obstacles(cloud)
        controller.set_goal(Q + 0.3)
        moved(controller, Q, np.zeros(7), 60)
    assert_equal(ss.replay(tmp_path / "run.mcap"), 60)


def camera_clouds(sets, rng):
    """Clouds of which a part changes from one to the next, in an order that changes, with a ball that moves."""
    cloud = rng.uniform(-1.0, 1.0, (800, 3)).astype(np.float32)
    cloud = cloud[np.linalg.norm(cloud[:, :2], axis=1) > 0.4]
    radii = rng.uniform(0.005, 0.01, len(cloud)).astype(np.float32)
    made = []
    for k in range(sets):
        changed = rng.integers(0, len(cloud), 30)
        cloud[changed] += rng.normal(0.0, 0.01, (30, 3)).astype(np.float32)
        order = np.roll(np.arange(len(cloud)), 7 * k)[: len(cloud) - 10 * (k % 3)]
        velocities = np.zeros((len(order), 3))
        velocities[: 20 * (k % 4)] = (0.0, -0.1, 0.0)
        made.append((cloud[order], radii[order], velocities))
    return made


def test_clouds_that_change_little_are_replayed_and_take_few_bytes(arm, tmp_path):
    clouds = camera_clouds(40, np.random.default_rng(5))
    controller = controller_of(arm)
    path = tmp_path / "run.mcap"
    with controller.record(path):
        controller.set_goal(Q + 0.3)
        q, v = Q, np.zeros(7)
        for k, (points, radii, velocities) in enumerate(clouds):
            as_told = ss.Obstacles(points, radii=radii, velocities=velocities)
            controller.set_obstacles(as_told, source="told", time=0.02 * k, valid_for=1.0)
            resting = ss.Obstacles(points + 0.5, radii=radii)  # whose velocities are found
            controller.set_obstacles(resting, source="resting", time=0.02 * k)
            if k % 10 == 9:
                controller.remove_obstacles("resting")
            for n in range(20):
                command = controller.step(q, v, time=0.02 * k + 0.001 * n)
                v = v + 0.001 * command.acceleration
                q = q + 0.001 * v
    assert_equal(ss.replay(path), 800)
    run = ss.load_recording(path)
    assert run.complete
    assert run.damage == ""
    with path.open("rb") as stream:
        messages_of_sets = NonSeekingReader(stream).iter_messages(topics=["/sidestep/obstacles"])
        size = sum(len(message.data) for _, _, message in messages_of_sets)
    in_full = 68 * sum(2 * len(points) for points, _, _ in clouds)  # [B]
    assert size < 0.35 * in_full


def test_held_objects_and_other_arms(arm, tmp_path):
    controller = controller_of(arm)
    hand = arm.robot.pose(Q, "fr3_hand")
    cup = hand[:3, 3] + 0.12 * hand[:3, 2]
    table = Box((0.3, 0.3, 0.04), pose=at(cup[0], cup[1], cup[2] - 0.071), name="table")
    held = {"link": "fr3_hand", "mass": 0.3, "may_touch": FINGERS}
    q, v, lifted = Q, np.zeros(7), False
    with controller.record(tmp_path / "run.mcap"):
        controller.set_obstacles([table])
        q, v = moved(controller, q, v, 20)
        cup_in_hand = np.linalg.inv(hand) @ at(*cup)
        controller.attach("cup", Cylinder(0.03, 0.1), pose=cup_in_hand, rests_on=["table"], **held)
        controller.set_goal(Q + np.array([0.0, -0.2, 0.0, 0.3, 0.0, 0.1, 0.0]))
        q, v = moved(controller, q, v, 20)
        resting = controller.arm.content_hash
        for _ in range(60):  # until the cup is off the table
            q, v = moved(controller, q, v, 20)
            lifted = controller.arm.content_hash != resting
            if lifted:
                break
        q, v = moved(controller, q, v, 20)
        controller.detach("cup")
        controller.set_goal(Q)  # set after the arm was changed, before a step takes it over
        q, v = moved(controller, q, v, 20)
        controller.set_arm(arm)
        moved(controller, q, v, 20)
    assert lifted
    result = ss.replay(tmp_path / "run.mcap")
    assert result.equal
    assert result.notes == []


START = np.array([-0.8, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8])
GOAL = np.array([0.8, 0.3, 0.0, -1.9, 0.0, 2.2, 0.8])
PACES = (
    2.0,
    6.0,
    20.0,
)  # times the period that a step lasts: until planner and look-ahead got enough processor time


def run_beside_workers(arm, path, output, pace):
    """A ball in the way and one that comes at the forearm; the parts of the controller that acted."""
    period, seen = 0.002, set()
    settings = ss.ControllerSettings(output=output, period=period, look_ahead=LookAheadSettings(tries=60))
    controller = ss.Controller(arm, settings)
    with controller.record(path):
        controller.set_goal(GOAL)
        centres, velocities = [[0.5, 0.02, 0.5], [0.56, 0.56, 1.14]], [[0.0] * 3, [-0.4, -0.4, -0.48]]
        controller.set_obstacles(ss.Obstacles(centres, [0.08, 0.04], velocities))
        q, v = START, np.zeros(7)
        begin = time.perf_counter()
        for k in range(500):
            command = controller.step(q, v)
            seen |= {name for name in ("avoiding", "on_path") if getattr(command, name)}
            v = v + period * command.acceleration
            q = q + period * v
            time.sleep(max(0.0, begin + pace * period * (k + 1) - time.perf_counter()))
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("output", ["acceleration", "torque"])
def test_results_of_workers_are_replayed_at_the_steps_that_took_them(arm, tmp_path, output):
    for pace in PACES:
        path = tmp_path / f"{pace}.mcap"
        seen = run_beside_workers(arm, path, output, pace)
        assert_equal(ss.replay(path), 500)
        if seen == {"avoiding", "on_path"}:  # what both found was followed
            return
    pytest.fail(f"only {sorted(seen)} acted at {pace} times the period")


@pytest.mark.slow
def test_a_posture_for_a_pose_is_replayed(arm, tmp_path):
    controller = ss.Controller(arm)
    controller.set_obstacles(ss.Obstacles.none())
    with controller.record(tmp_path / "run.mcap"):
        q, v, steps = Q, np.zeros(7), 0
        while controller.target is None or steps < 300:
            if steps % 1000 == 0:  # on a busy machine the arm may arrive before a posture is found
                goal = Q + (0.2 if steps % 2000 == 0 else -0.2)
                controller.set_goal(ss.PoseGoal(arm.robot, "fr3_hand", arm.robot.pose(goal, "fr3_hand")))
            q, v = moved(controller, q, v, 1)
            steps += 1
            assert steps < 60000
            time.sleep(0.001)
    assert_equal(ss.replay(tmp_path / "run.mcap"), steps)


@pytest.mark.slow
def test_requests_of_other_threads_are_replayed_at_the_steps_that_took_them(arm, tmp_path):
    controller = ss.Controller(arm)
    robot = arm.robot
    over = threading.Event()

    def ask():
        rng = np.random.default_rng(0)
        while not over.is_set():
            q = Q + rng.uniform(-0.3, 0.3, 7)
            controller.set_goal(ss.PoseGoal(robot, "fr3_hand", robot.pose(q, "fr3_hand")))
            controller.set_obstacles(balls(rng.uniform(0.0, 0.1)))
            controller.set_velocity(rng.uniform(-0.2, 0.2, 7))
            controller.set_goal(q)
            time.sleep(0.002)

    with controller.record(tmp_path / "run.mcap"):
        thread = threading.Thread(target=ask)
        thread.start()
        run = Loop(controller, ss.drivers.Ideal(controller.arm, Q), PATIENT, duration=1.5)
        run.start()
        time.sleep(0.5)
        controller.attach("rod", Cylinder(0.02, 0.2), link="fr3_hand", pose=at(0, 0, 0.2), may_touch=FINGERS)
        controller.detach("rod")
        report = run.finish()
        over.set()
        thread.join()
    result = ss.replay(tmp_path / "run.mcap")
    assert result.steps >= report.cycles >= 1500
    assert_equal(result, result.steps)


def test_a_recording_that_was_cut_off_is_read_up_to_its_last_whole_step(recorded, tmp_path):
    data = recorded[0].read_bytes()
    steps = step_records(data)
    for cut, whole in (
        (steps[99][1], 100),
        (steps[100][1] - 1, 100),
        (steps[100][0] + 5, 100),
        (steps[0][0], 0),
    ):
        (tmp_path / "cut.mcap").write_bytes(data[:cut])
        result = ss.replay(tmp_path / "cut.mcap")
        assert result.equal
        assert not result.complete
        assert result.steps == whole


def test_a_bit_that_flipped_on_the_disk_is_found(recorded, tmp_path):
    data = bytearray(recorded[0].read_bytes())
    begin, _ = step_records(data)[149]
    data[begin + BEFORE_Q] ^= 1
    (tmp_path / "flipped.mcap").write_bytes(data)
    result = ss.replay(tmp_path / "flipped.mcap")
    assert not result.equal
    assert result.steps == 149
    assert f"the bytes from {begin} on, after step 149" in result.damage


def test_an_input_that_is_another_in_its_last_bit_is_named_by_step_and_field(recorded, tmp_path):
    data = bytearray(recorded[0].read_bytes())
    begin, end = step_records(data)[149]
    data[begin + BEFORE_Q] ^= 1  # the last bit of q[0] in step 150
    sign(data, begin, end)
    (tmp_path / "changed.mcap").write_bytes(data)
    result = ss.replay(tmp_path / "changed.mcap")
    assert not result.equal
    assert result.damage == ""
    assert result.steps == result.difference.step == 150
    assert result.difference.recorded != result.difference.replayed


def test_a_changed_setting_is_named_with_the_first_command_that_differs(recorded):
    header = read_recording_header(recorded[0])
    changed = header.settings
    damping = changed.barriers.damping
    changed.barriers = BarrierSettings(damping=damping + 1.0)
    result = ss.replay(recorded[0], settings=changed)
    assert result.notes == [
        f"setting barriers.damping: recorded {damping:g}, replayed with {damping + 1.0:g}"
    ]
    assert not result.equal
    assert result.difference.step >= 1
    assert_equal(ss.replay(recorded[0], settings=header.settings), recorded[1])


def test_another_arm_is_named(recorded):
    result = ss.replay(recorded[0], arm=ss.Arm.load("iiwa"))
    assert result.notes[0].startswith("arm: recorded 'fr3' with hash ")
    assert not result.equal


def test_the_header_has_arm_and_settings(arm, tmp_path):
    settings = ss.ControllerSettings(
        synchronous=True, seed=2**63 + 1, look_ahead=None, barriers=BarrierSettings(activation=0.07)
    )
    with ss.Controller(arm, settings).record(tmp_path / "run.mcap"):
        pass
    header = read_recording_header(tmp_path / "run.mcap")
    assert header.arm.content_hash == arm.content_hash
    assert repr(header.settings) == repr(settings)
    assert header.sidestep_version == ss.__version__
    assert header.notes == []


def test_recording_begins_before_the_first_step_and_once(arm, tmp_path):
    controller = controller_of(arm)
    controller.step(Q, np.zeros(7))
    with pytest.raises(RuntimeError, match=r"before the first step, but it has made 1"):
        controller.record(tmp_path / "late.mcap")
    controller = controller_of(arm)
    controller.record(tmp_path / "once.mcap").stop()
    with pytest.raises(RuntimeError, match="recorded already"):
        controller.record(tmp_path / "twice.mcap")


def test_what_is_no_recording_is_refused(tmp_path):
    (tmp_path / "text.mcap").write_text("a text that is long enough")
    with pytest.raises(ValueError, match="it is not a recording"):
        ss.replay(tmp_path / "text.mcap")
    with pytest.raises(FileNotFoundError):
        ss.replay(tmp_path / "none.mcap")
    with pytest.raises(FileNotFoundError):
        controller_of(ss.Arm.load("planar2")).record(tmp_path / "no" / "folder.mcap")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_told_when_the_recording_ends(arm):
    controller = controller_of(arm)
    recording = controller.record("/dev/full")
    moved(controller, Q, np.zeros(7), 5)
    with pytest.raises(OSError, match="No space left"):
        recording.stop()
    moved(controller, Q, np.zeros(7), 5)  # steps go on


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_steps_do_not_wait_for_a_slow_disk_and_what_is_lost_is_counted(arm, tmp_path):
    pipe = tmp_path / "slow.mcap"
    os.mkfifo(pipe)
    disk = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)  # takes nothing yet
    settings = ss.ControllerSettings(output="torque", planner=None, look_ahead=None)
    controller = ss.Controller(arm, settings)
    controller.set_obstacles(ss.Obstacles.none())
    recording = controller.record(pipe)
    mass, bias, v = arm.mass_matrix(Q), arm.bias(Q, np.zeros(7)), np.zeros(7)
    steps = 18_000  # of 1.2 kB: more than 16 MiB
    for _ in range(steps):
        controller.step(Q, v, mass, bias)
    taken = []

    def take():
        while not over.is_set() or (taken and taken[-1]):
            try:
                taken.append(os.read(disk, 1 << 20))
            except BlockingIOError:
                time.sleep(0.001)

    over = threading.Event()
    thread = threading.Thread(target=take, daemon=True)
    thread.start()
    with pytest.warns(
        RuntimeWarning, match=r"the disk was too slow, so that \d+ steps after step \d+ are lost"
    ):
        summary = recording.stop()
    over.set()
    thread.join()
    os.close(disk)
    assert summary.lost > 0
    assert summary.steps + summary.lost == steps
    (tmp_path / "read.mcap").write_bytes(b"".join(taken))
    result = ss.replay(tmp_path / "read.mcap")
    assert result.equal
    assert result.complete
    assert (result.steps, result.lost) == (summary.steps, summary.lost)


def test_a_program_that_is_killed_leaves_what_it_has_recorded(tmp_path):
    path = tmp_path / "killed.mcap"
    program = f"""
import os, time
import numpy as np
import sidestep as ss
controller = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True))
recording = controller.record({str(path)!r})
for _ in range(50):
    controller.step(np.zeros(2), np.zeros(2))
time.sleep(0.5)  # the writer looks every 2 ms
os.kill(os.getpid(), 9)
"""
    assert subprocess.run([sys.executable, "-c", program]).returncode == -9
    result = ss.replay(path)
    assert result.equal
    assert not result.complete
    assert result.steps == 50


def test_a_variable_has_every_controller_recorded(arm, tmp_path, monkeypatch):
    monkeypatch.setenv("SIDESTEP_RECORD", str(tmp_path / "all"))
    for steps in (3, 0, 5):
        moved(controller_of(arm), Q, np.zeros(7), steps)
    monkeypatch.delenv("SIDESTEP_RECORD")
    moved(controller_of(arm), Q, np.zeros(7), 7)
    paths = sorted((tmp_path / "all").iterdir())
    assert [ss.replay(path).steps for path in paths] == [3, 5]


def test_the_command_line_tells_equal_from_different(recorded, tmp_path):
    run = CliRunner()
    path, steps = recorded
    equal = run.invoke(app, ["replay", str(path)])
    assert equal.exit_code == 0, equal.output
    assert f"{steps} steps (0.480 s) of 'fr3'" in equal.output
    assert "all commands are equal bit for bit" in equal.output

    data = bytearray(path.read_bytes())
    begin, end = step_records(data)[149]
    data[begin + BEFORE_Q] ^= 1
    sign(data, begin, end)
    (tmp_path / "changed.mcap").write_bytes(data)
    (tmp_path / "same.mcap").write_bytes(path.read_bytes())
    other = run.invoke(app, ["replay", str(tmp_path), "--json", str(tmp_path / "figures.json"), "--quiet"])
    assert other.exit_code == 1
    assert other.output == ""
    document = json.loads((tmp_path / "figures.json").read_text("utf-8"))
    assert document["equal"] is False
    assert [row["equal"] for row in document["recordings"]] == [False, True]
    assert document["recordings"][0]["difference"]["step"] == 150

    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="there is no recording"):
        run.invoke(app, ["replay", str(tmp_path / "empty")], catch_exceptions=False)
