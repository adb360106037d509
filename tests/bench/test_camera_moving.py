"""Moving obstacles through cameras: the same encounters, seen alone, counted where they were in view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.bench.camera_stand_ins import needs_opengl

from sidestep.bench import CameraMovingSettings, Seen, camera_moving_table, run_encounter
from sidestep.bench.camera_moving import CameraMovingTask, EncounterView
from sidestep.bench.encounters import IdealPlant
from sidestep.bench.moving import maker_and_judge


def test_the_campaign_of_the_issue() -> None:
    tasks = CameraMovingSettings().tasks()
    assert len(tasks) == 2 * 2 * 3 * 3 * 6
    assert len({task.name for task in tasks}) == len(tasks)
    assert sum(task.holds for task in tasks) == len(tasks) // 2
    late = CameraMovingSettings().rig(CameraMovingTask("fr3", Seen.lost30, "10Hz", 0.2, 0))
    assert (late.rate, late.latency, late.lost, len(late.azimuths)) == (10.0, 0.15, 0.3, 2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"runs": 0}, "nothing to run"),
        ({"timings": ("60Hz",)}, "timing is '60Hz', allowed: 30Hz, 10Hz"),
        ({"speeds": (0.0,)}, "speed is 0.0 m/s"),
        ({"cameras": 3}, "cameras is 3, allowed: 1 to 2"),
    ],
)
def test_values_that_are_not_allowed_are_named(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CameraMovingSettings(**given)  # type: ignore[arg-type]


def test_the_arm_learns_of_the_solid_by_images_alone() -> None:
    maker, _ = maker_and_judge("fr3")
    task = CameraMovingTask("fr3", Seen.noise, "30Hz", 0.5, 0)
    view = EncounterView(maker.robot, CameraMovingSettings().rig(task), seed=0)
    with needs_opengl():
        encounter = maker.make(task.moving, seed=0, teller=view.tell)
    told = maker.make(task.moving, seed=0)
    np.testing.assert_array_equal(encounter.objects[0].pose, told.objects[0].pose)
    with view:
        run_encounter(
            maker.arm, replace(encounter, steps=120), output="acceleration", plant=IdealPlant(encounter.start)
        )
        # Images of the first camera are due at 0, 33, 67 and 100 ms, of the second half a period later; 50 ms late.
        assert [camera for _, camera, _ in view.rig.reports] == ["camera_0", "camera_1"] * 2 + ["camera_0"]
        assert all(report.used for _, _, report in view.rig.reports)
        assert view.rig.perception is not None
        centres = np.asarray(view.rig.perception.cells()["centres"])
    solid = encounter.objects[0]
    away = np.linalg.norm(centres - solid.pose_at(0.05)[:3, 3], axis=1)
    assert (away < 0.5).sum() > 20
    assert view.log.first_seen is not None


def row(**changed: object) -> dict[str, object]:
    plain = {
        "robot": "fr3", "timing": "30Hz", "seen": "noise", "speed": 0.5, "run": 0, "clearance_m": 0.1,
        "self_clearance_m": 0.02, "way_out": None, "counts": False, "in_view_s": None, "contact_s": None,
        "contact_speed": None, "pair": "link - solid", "before_contact": "",
    }  # fmt: skip
    return plain | changed


def test_contacts_count_with_a_way_out_of_what_was_in_view() -> None:
    touched = {"clearance_m": -0.01, "contact_s": 1.0, "contact_speed": 0.123, "before_contact": "ok"}
    table = camera_moving_table(
        [
            row(),
            row(run=1, way_out=False, counts=True, in_view_s=0.5, **touched),
            row(run=2, way_out=True, counts=False, in_view_s=0.1, **touched),
            row(run=3, way_out=True, counts=True, in_view_s=0.4, **touched),
            row(robot="ur10"),
        ]
    )
    cell = table["fr3"]["30Hz noise 0.5"]
    assert [cell[key] for key in ("runs", "contacts", "with_way_out", "in_view")] == [4, 3, 2, 1]
    assert cell["contact_speeds"] == [0.12, 0.12, 0.12]
    assert cell["cases"][1] == "run 3: link - solid at 1.00 s, in view for 0.40 s before, the status was ok"
    assert table["ur10"]["30Hz noise 0.5"]["contacts"] == 0
