"""The depth camera of a session: what the controller knows with it, and what the page is told."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from sidestep import Scenario
from sidestep.studio import messages as m
from sidestep.studio.camera_choice import HAND, PLACES, CameraChoice, believed_noise, camera_at
from sidestep.studio.session import Session
from sidestep.studio.sight import HIDDEN, REMEMBERED, SEEN
from studio.egl import NEEDS_EGL

Make = Callable[..., Session]


@pytest.fixture
def session(scenario: Scenario, make_session: Make) -> Iterator[Session]:
    session = make_session(scenario)
    yield session
    session.stop()


def choice_of(session: Session, place: str = "front right", **options: object) -> CameraChoice:
    pose, link = camera_at(place, session.robot)
    return CameraChoice(pose, link, place, **options)  # type: ignore[arg-type]


def run(session: Session, steps: int) -> m.Snapshot:
    for _ in range(steps):
        session.step()
    return session.snapshot()


@NEEDS_EGL
def test_the_arm_reaches_its_goal_with_the_camera_only(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, only=True)))
    first = run(session, 20)  # the first image arrives after 50 ms
    assert "never set" in first.words
    assert first.camera.sight is None
    end = run(session, 4000)
    assert np.abs(end.q - end.goal).max() < 1e-3
    assert end.touched == 0
    sight = end.camera.sight
    assert sight is not None
    assert sight.number == 41  # 10 Hz for 4.02 s
    assert end.camera.lost == 0
    np.testing.assert_allclose(end.camera.age, 4.02 - sight.time, atol=1e-9)
    ball = end.poses[0][:3, 3]
    radius = end.things[0].obstacle.shape.radius
    away = np.linalg.norm(sight.centres - ball, axis=1)
    assert len(away) > 20
    assert np.abs(away - radius).max() < 0.03  # every cell is at the surface of the ball: 2 cm and noise
    assert sight.pixels["arm"] > 0.01
    assert sum(sight.pixels.values()) == pytest.approx(1.0)


@NEEDS_EGL
def test_told_shapes_explain_what_is_seen(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, noise="none")))
    sight = run(session, 500).camera.sight
    assert sight is not None
    assert len(sight.kinds) == 0
    assert sight.explained > 20
    assert sight.pixels["explained"] > 0.0


@NEEDS_EGL
def test_what_the_hand_no_longer_shows_is_remembered(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, HAND, only=True, noise="none")))
    sight = run(session, 1500).camera.sight  # the hand has turned past the ball
    assert sight is not None
    kinds = np.bincount(sight.kinds, minlength=3)
    assert kinds[SEEN] == 0
    assert kinds[REMEMBERED] > 12  # a part of the ball, in cells of 2 cm
    assert kinds[HIDDEN] > 10  # what came too near for the camera, or behind what it saw
    assert (
        0.4 < sight.ages.min() <= sight.ages.max() < 0.8
    )  # [s] in view up to 0.9 s, of 1.45 s at the last image


@NEEDS_EGL
def test_what_moves_is_told_apart(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, only=True, noise="none", rate=30.0)))
    rests = run(session, 500)
    assert len(rests.camera.moving) == 0
    session.handle(m.ThrowObstacle("ball", np.array([0.0, -0.5, 0.0])))
    now = run(session, 500)
    assert len(now.camera.moving) > 20
    np.testing.assert_allclose(
        now.camera.speeds, 0.5, atol=0.15
    )  # [m/s] of cells of 2 cm, in images 33 ms apart
    away = np.linalg.norm(now.camera.moving[:, :3] - now.poses[0][:3, 3], axis=1)
    assert away.max() < 0.09  # [m] the ball has 6 cm
    assert now.touched == 0


@NEEDS_EGL
def test_a_gone_obstacle_is_gone_for_the_controller(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, only=True)))
    seen = run(session, 500).camera.sight
    assert seen is not None
    assert len(seen.kinds) > 20
    session.handle(m.RemoveObstacle("ball"))
    sight = run(session, 500).camera.sight
    assert sight is not None
    assert len(sight.kinds) == 0


@NEEDS_EGL
def test_unseen_space_is_closed_where_asked(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, unseen_is_free=False, only=True)))
    sight = run(session, 500).camera.sight
    assert sight is not None
    assert len(sight.unseen) > 50


@NEEDS_EGL
def test_switched_off_the_scene_is_told_again(session: Session) -> None:
    session.handle(m.SetCamera(choice_of(session, only=True)))
    run(session, 200)
    session.handle(m.SetCamera(None))
    end = run(session, 4000)
    assert end.camera.choice is None
    assert np.abs(end.q - end.goal).max() < 1e-3
    assert end.touched == 0


def test_without_opengl_it_says_what_to_install(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "glfw")  # which needs a display
    monkeypatch.delenv("DISPLAY", raising=False)
    session.handle(m.SetCamera(choice_of(session, only=True)))
    end = run(session, 4000)
    assert end.camera.choice is None
    assert "libegl1 and libgl1-mesa-dri" in end.camera.error
    assert np.abs(end.q - end.goal).max() < 1e-3  # by the scene, which is told again
    assert end.touched == 0


@pytest.mark.parametrize("place", [*PLACES, HAND])
def test_places_look_at_the_arm_and_the_hand_forwards(session: Session, place: str) -> None:
    pose, link = camera_at(place, session.robot)
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    if link:  # the arm lies in the plane z = 0 and points away from its base
        tip = session.robot.pose(session.robot.neutral, link)
        seen = tip @ pose
        way = tip[:3, 3] / np.linalg.norm(tip[:3, 3])
        np.testing.assert_allclose(seen[:3, 2], way, atol=1e-9)
    else:
        target = np.array([0.40, 0.0, 0.30])
        way = target - pose[:3, 3]
        np.testing.assert_allclose(pose[:3, 2], way / np.linalg.norm(way), atol=1e-9)


def test_the_noise_is_believed_as_it_is() -> None:
    noise = believed_noise("d435")
    # sigma = s z^2 / (f b), s of 0.08 pixel and steps of 1/32 at the sensor's f = 424 pixel, b = 0.05 m
    assert noise.quadratic == pytest.approx(0.0805 / 21.2, rel=0.01)
    assert believed_noise("none").quadratic == 0.0


def test_bad_values_are_refused(session: Session) -> None:
    choice = choice_of(session)
    for bad, words in (
        ({"noise": "fog"}, "noise is 'fog', allowed: none, d435"),
        ({"rate": 0.0}, "rate is 0.0 Hz, allowed: 1 to 100"),
        ({"latency": -1.0}, "latency is -1.0 s, allowed: 0 to 1"),
    ):
        with pytest.raises(ValueError, match=words):
            dataclasses.replace(choice, **bad)
    with pytest.raises(ValueError, match="place is 'moon', allowed: front left"):
        camera_at("moon", session.robot)
