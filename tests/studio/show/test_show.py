"""The page without a browser: its server, the scene, and what is measured beside it."""

from __future__ import annotations

import threading
import time as clock
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sidestep.robot import Robot
from sidestep.shipped_arms import shipped_file
from sidestep.studio.show import touching as touching_module
from sidestep.studio.show.reading import read
from sidestep.studio.show.shapes import drawable_shapes
from sidestep.studio.show.show import Show
from sidestep.studio.show.touching import Touching, TouchMonitor

PATIENCE = 60.0  # [s] at most for anything: a busy machine


@pytest.fixture
def planar() -> Iterator[Show]:
    with Show(read("planar2", {}), port=0) as running:
        running.wait_ready()
        yield running


def until(condition: Any, what: str) -> None:
    end = clock.monotonic() + PATIENCE
    while not condition():
        assert clock.monotonic() < end, f"{what}: not within {PATIENCE:.0f} s"
        clock.sleep(0.02)


def node(show: Show, name: str) -> Any:
    """A node of viser's scene."""
    return show.server.scene._handle_from_node_name[name]


def test_a_slider_moves_the_links_in_the_scene(planar: Show) -> None:
    view = planar.view
    assert view is not None
    first, second = view._sliders._sliders
    assert (first.label, first.min, first.max) == ("joint1 [°]", -180.0, 180.0)
    first.value = 90.0
    for callback in first._impl.update_cb:
        # as viser calls it for a person
        run(callback(SimpleNamespace(client=object(), target=first)))
    # links of 0.5 m: the second begins straight up the y axis, and points there, a quarter turn about z
    assert node(planar, "/arm/link2").position == pytest.approx([0.0, 0.5, 0.0], abs=1e-9)
    assert node(planar, "/arm/link2").wxyz == pytest.approx([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    assert node(planar, "/arm/tip").position == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    assert "1.5708 rad" in view._words.content
    assert "90.0°" in view._words.content
    assert second.value == 0.0


def run(coroutine: Any) -> None:
    with pytest.raises(StopIteration):
        coroutine.send(None)


def test_postures_move_arm_and_sliders(planar: Show) -> None:
    view = planar.view
    assert view is not None
    view.show(np.array([0.5, -0.25]))
    robot = planar._reading.robot
    assert node(planar, "/arm/tip").position == pytest.approx(robot.pose([0.5, -0.25], "tip")[:3, 3])
    # sliders show one decimal of a degree
    assert [slider.value for slider in view._sliders._sliders] == pytest.approx(
        np.rad2deg([0.5, -0.25]), abs=0.05
    )


def test_base_and_tip_have_named_axes(planar: Show) -> None:
    assert node(planar, "/arm/base/base_axes/name").text == "base: base"
    assert node(planar, "/arm/tip/tip_axes/name").text == "tip: tip"


def test_collision_shapes_are_drawn_when_asked_for(planar: Show) -> None:
    view = planar.view
    assert view is not None
    assert view.collision == []
    view._show_collision(True)
    assert [(part.name, part.visible) for part in view.collision] == [
        ("/arm/link1/collision", True),
        ("/arm/link2/collision", True),
    ]
    view._show_collision(False)
    assert [part.visible for part in view.collision] == [False, False]


def test_the_panel_says_what_was_read(planar: Show) -> None:
    assert "mass: 1.728 kg" in planar.panel.text
    assert "No warnings" in planar.panel.text
    until(lambda: "none, on the exact meshes" in planar.panel.text, "what touches")


def test_an_arm_file_shows_its_ellipsoids() -> None:
    file = shipped_file("planar2")
    assert file is not None
    with Show(read(str(file), {}), port=0) as running:
        view = running.wait_ready()
        assert view.body is not None
        batches = view.body._batches
        assert set(batches) == {"link1", "link2"}
        assert all(batch.visible for batch in batches.values())


def test_nobody_without_the_token_gets_the_page(planar: Show) -> None:
    assert planar.address.startswith(f"http://127.0.0.1:{planar.port}/")
    with urllib.request.urlopen(planar.address) as answer:
        assert answer.status == 200
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(f"http://127.0.0.1:{planar.port}/")
    assert refused.value.code == 403


def test_a_mesh_that_cannot_be_read_is_said_and_the_rest_is_shown(tmp_path: Path) -> None:
    (tmp_path / "bad.obj").write_text("v 0 0 0\nf 1 2 3\n")
    (tmp_path / "arm.urdf").write_text(
        """<robot name="x"><link name="base"/><link name="a">
        <visual><geometry><mesh filename="bad.obj"/></geometry></visual>
        <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
        <joint name="j" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
        <limit velocity="1" effort="1"/></joint></robot>"""
    )
    with Show(read(str(tmp_path / "arm.urdf"), {}), port=0) as running:
        running.wait_ready()
        assert "link &#x27;a&#x27;: a shape is not drawn" in running.panel.text
        assert node(running, "/arm/a/mesh").vertices.max() == pytest.approx(0.05)  # the box in its place


def test_names_of_a_description_are_text_not_markup(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(
        """<robot name="&lt;b&gt;x"><link name="base"/><link name="&lt;script&gt;"/>
        <joint name="j&lt;i&gt;" type="continuous"><parent link="base"/><child link="&lt;script&gt;"/>
        <axis xyz="0 0 1"/><limit velocity="1" effort="1"/></joint></robot>"""
    )
    with Show(read(str(tmp_path / "arm.urdf"), {}), port=0) as running:
        view = running.wait_ready()
        assert "<script>" not in running.panel.text
        assert "&lt;b&gt;x" in running.panel.text
        assert "j<i>" not in view._words.content


def test_what_touches_is_measured_once_the_joints_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    told = threading.Event()

    def at(self: object, q: np.ndarray) -> Touching:
        asked.append(float(q[0]))
        return Touching()

    monkeypatch.setattr(touching_module.TouchCheck, "at", at)
    monkeypatch.setattr(touching_module, "REST", 0.5)
    monitor = TouchMonitor(Robot.named("planar2"), lambda found, q: told.set())
    before = clock.monotonic()
    for value in np.linspace(0.0, 1.0, 5):
        monitor.look(np.array([value, 0.0]))
    assert clock.monotonic() - before < 0.4  # asking does not wait
    assert told.wait(PATIENCE)
    monitor.stop()
    assert asked == [1.0]


def test_loading_ends_where_the_page_is_stopped() -> None:
    looked = iter([False, True])  # after the first link
    shapes = drawable_shapes(Robot.named("planar3"), lambda: next(looked))
    assert list(shapes.seen) == ["base"]
