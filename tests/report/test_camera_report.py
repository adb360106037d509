"""The report of a recording of depth images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sidestep import Arm
from sidestep.perception import CameraRecord, Frame, open_recording
from sidestep.perception.playback import Playback
from sidestep.report.camera_figures import CameraFigures, ImageFigures, spread
from sidestep.report.camera_page import report_images, report_played
from sidestep.report.spread_samples import SpreadSamples
from support.camera_scene import HOLES, WIDTH, write_recording

CAMERA = CameraRecord("front", 4, 2, 2.0, 2.0, 1.5, 0.5)


def figures(times: list[float], *, known: bool = True) -> CameraFigures:
    result = CameraFigures(CAMERA, times_known=known)
    result.images += [ImageFigures(time, 0.25) for time in times]
    return result


def test_holes_are_what_is_zero_or_no_number() -> None:
    whole = np.array([[0, 1, 2, 3], [4, 5, 6, 0]], dtype=np.uint16)
    assert ImageFigures.of(Frame("front", 1.0, whole, 0.001)).holes == 0.25
    metres = np.array([[0.0, np.nan, np.inf, -np.inf], [1.0, 2.0, 3.0, 4.0]], dtype=np.float32)
    assert ImageFigures.of(Frame("front", 1.0, metres, 1.0)).holes == 0.5


def test_lost_images_are_gaps_of_the_period() -> None:
    even = figures([10.0 + n / 30.0 for n in range(10)])
    assert (even.lost, even.document()["rate_hz"]) == (0, pytest.approx(30.0))
    gaps = figures([n / 30.0 for n in range(20) if n not in (3, 8, 9, 10)])
    assert (gaps.lost, gaps.document()["rate_hz"]) == (4, pytest.approx(30.0))
    late = figures([0.0, 0.1, 0.24, 0.3])  # late by less than half a period: none is missing
    assert late.lost == 0
    unknown = figures([n / 30.0 for n in range(10)], known=False)
    assert (unknown.lost, unknown.document()["rate_hz"], unknown.document()["duration_s"]) == (
        None,
        None,
        None,
    )
    assert figures([1.0]).lost is None


def test_spread() -> None:
    assert spread(np.arange(101.0)) == {"p50": 50.0, "p99": 99.0, "max": 100.0}
    assert spread(np.zeros(0)) is None


@pytest.mark.parametrize("length", [1, 3, 6, 7, 50, 1000])
def test_samples_are_spread_evenly(length: int) -> None:
    samples = SpreadSamples[int](3)
    made = []
    for n in range(length):
        samples.offer(lambda n=n: made.append(n) or n)
    chosen = samples.chosen()
    assert len(chosen) == min(length, 3)
    assert chosen == sorted(set(chosen))
    assert chosen[0] == 0
    if length >= 50:  # halves, but for a stride that is an eighth to a sixteenth of the stream
        assert max(np.diff([*chosen, length])) <= 0.64 * length
        assert len(made) <= 12 + 6 * np.log2(length)


def test_no_samples_are_made_where_none_are_wanted() -> None:
    samples = SpreadSamples[int](0)
    samples.offer(lambda: pytest.fail("made"))
    assert samples.chosen() == []


def test_a_played_recording_has_all_figures_and_pictures(tmp_path: Path) -> None:
    arm = Arm.load("fr3")
    write_recording(tmp_path / "scene", arm, count=8, lost=[4])
    told: list[int] = []
    report = report_played(
        Playback(open_recording(tmp_path / "scene"), arm), "scene", pictures=2, progress=told.append
    )
    assert told == [1, 2, 3, 4, 5, 6, 7]
    document = report.document()
    (camera,) = document["cameras"]
    assert (document["robot"], document["images"], document["skipped"]) == ("fr3", 7, 0)
    assert (camera["images"], camera["lost"], camera["used"]) == (7, 1, 7)
    assert camera["rate_hz"] == pytest.approx(30.0)
    assert camera["duration_s"] == pytest.approx(7 / 30.0)
    assert camera["holes"]["p50"] == pytest.approx(HOLES / WIDTH)
    assert 700 < camera["arm_pixels"]["p50"] < 1000
    assert camera["through_share"]["max"] == 0.0
    assert camera["seen"]["max"] > 13_500  # the wall, in cells that grow with the distance from the arm
    assert 0.0 < camera["remembered"]["max"] < 500  # what the arm hides of it
    assert camera["questions"] == {}
    stages = camera["stages_s"]
    assert stages["total"]["max"] >= stages["mask"]["max"] > 0.0
    report.write(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 6 + 2  # plots and images
    assert "Image 1 of 7, 0.000 s after the first" in page
    assert "http" not in page  # it needs nothing else


def test_the_images_alone_need_no_arm(tmp_path: Path) -> None:
    write_recording(tmp_path / "a <scene>", Arm.load("fr3"), count=3, joints=False)
    report = report_images(open_recording(tmp_path / "a <scene>"), "a <scene>")
    (camera,) = report.document()["cameras"]
    assert (camera["images"], camera["lost"]) == (3, 0)
    assert "stages_s" not in camera
    report.write(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 1
    assert "<h1>a &lt;scene&gt;: 3 depth images</h1>" in page
