"""The page of `sidestep camera view`, without a browser: what it holds after an image."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sidestep import Arm
from sidestep.perception import open_recording
from sidestep.perception.pictures import label_picture
from sidestep.perception.playback import Playback
from sidestep.studio.camera_view import CameraView
from support.camera_scene import write_recording


def test_the_page_shows_images_cells_and_arm(tmp_path: Path) -> None:
    arm = Arm.load("fr3")
    write_recording(tmp_path / "scene", arm, count=3)
    playback = Playback(open_recording(tmp_path / "scene"), arm)
    with CameraView(arm, port=0) as page:
        assert page.address.startswith(f"http://127.0.0.1:{page.port}/")
        assert not page.paused
        for played in playback.play():
            stages = playback.stages("front")
            page.show(stages, played.report, played.q)
        assert np.array_equal(page._arm.q, played.q)
        words = page._words.content
        assert f"seen now: {stages.cells()['seen']:,} cells" in words
        assert f"remembered, hidden: {stages.cells()['hidden']:,} cells, 0.0" in words
        assert f"the arm, taken out: {stages.pixels()['arm']:,} pixels" in words
        (images,) = page._images.values()  # of one camera, replaced by each image
        assert np.array_equal(images[1].image, label_picture(stages.labels))
        assert page.wait(0.0) is False
    assert page.wait(0.0) is True


def test_an_arm_of_a_file_is_shown_by_its_body(tmp_path: Path) -> None:
    Arm.load("fr3").save(tmp_path / "fr3.arm")
    with CameraView(Arm.load(tmp_path / "fr3.arm"), port=0) as page:
        names = page.server.scene._handle_from_node_name
        assert any(name.endswith("/body") for name in names)


def test_a_port_that_is_taken_is_refused() -> None:
    with CameraView(Arm.load("fr3"), port=0) as page:
        with pytest.raises(OSError, match=f"port {page.port} is taken"):
            CameraView(Arm.load("fr3"), port=page.port)
