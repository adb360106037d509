"""Published problem folders: what is read, by value, and what is refused."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from sidestep import Box, Cylinder, Sphere
from sidestep.bench import read_motion_bench_maker

FOLDER = Path(__file__).parent / "motion_bench_maker"


def test_a_folder_of_sets_is_read_in_order() -> None:
    pick, reach = read_motion_bench_maker(FOLDER)
    assert [(pick.set, pick.index), (reach.set, reach.index)] == [("pick_panda", 3), ("reach_panda", 1)]
    assert reach.held == {"panda_finger_joint1": 0.065, "panda_finger_joint2": 0.065}
    assert reach.goal["panda_joint4"] == -2.2
    assert list(reach.goal) == [f"panda_joint{k}" for k in range(1, 8)]
    assert pick.shapes == {}
    assert pick.allowed == ()


def test_shapes_stand_in_the_frame_of_the_robots_root() -> None:
    """The robot is 0.1 m above the world's origin; the frame `shelf` is turned by 90 degrees about z."""
    [problem] = read_motion_bench_maker(FOLDER / "reach_panda")
    plate, can, ball = problem.shapes.values()
    assert list(problem.shapes) == ["plate", "cans_0", "cans_1"]
    assert isinstance(plate, Box)
    assert isinstance(can, Cylinder)
    assert isinstance(ball, Sphere)
    assert plate.size == (0.4, 0.2, 0.02)
    assert (can.length, can.radius, ball.radius) == (0.14, 0.03, 0.05)
    # 1e-12: rounding, the quaternion is normalised although it is written with four digits
    np.testing.assert_allclose(plate.pose[:3, 3], [0.6, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(can.pose[:3, 3], [0.8, 0.1, 0.2], atol=1e-12)
    np.testing.assert_allclose(ball.pose[:3, 3], [0.8, 0.1, 0.4], atol=1e-12)
    np.testing.assert_allclose(can.pose[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)


def test_the_matrix_gives_the_pairs_that_may_touch() -> None:
    [problem] = read_motion_bench_maker(FOLDER / "reach_panda")
    assert problem.allowed == (("panda_hand", "panda_link5"), ("panda_hand", "panda_link7"))


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        (
            "scene",
            "type: box",
            "type: cone",
            "primitives[0] is {'type': 'cone', 'dimensions': [0.4, 0.2, 0.02]}",
        ),
        ("scene", "[0.14, 0.03]", "[0.14]", "primitives[0] is {'type': 'cylinder', 'dimensions': [0.14]}"),
        ("scene", "[0.14, 0.03]", "[-0.14, 0.03]", "cylinder: length is -0.14, must be positive"),
        ("scene", "{frame_id: shelf}", "{frame_id: moon}", "frame_id is 'moon'; allowed: shelf"),
        ("scene", "id: plate", "id: cans_0", "there are two objects 'cans_0'"),
        (
            "scene",
            "panda_link5",
            "plate",
            "one that lets panda_hand and plate touch; allowed: pairs of links",
        ),
        ("scene", "    - [true, false, false]\n", "", "entry_values is another shape; allowed: 3 rows of 3"),
        ("scene", "world:", "World:", "has no 'world'"),
        ("request", "0.065]", "nan]", "position[8] is 'nan'; allowed: a finite number"),
        ("request", "joint_constraints", "position_constraints", "joint_constraints only"),
        ("request", ", 0.065, 0.065]", "]", "position is 7 positions; allowed: 9 positions, one per name"),
        ("request", "start_state", "state", "has no 'start_state'"),
        ("request", "goal_constraints:", "goal_constraints: [", "is not well-formed YAML"),
    ],
)
def test_what_is_not_understood_is_named(tmp_path: Path, file: str, old: str, new: str, message: str) -> None:
    folder = shutil.copytree(FOLDER / "reach_panda", tmp_path / "reach_panda")
    path = folder / f"{file}0001.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=re.escape(message)) as error:
        read_motion_bench_maker(tmp_path)
    assert str(path) in str(error.value) or "cylinder: length" in message


def test_missing_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"hold no requestNNNN\.yaml"):
        read_motion_bench_maker(tmp_path)
    with pytest.raises(FileNotFoundError, match="is not a folder"):
        read_motion_bench_maker(tmp_path / "none")
    shutil.copy(FOLDER / "reach_panda" / "request0001.yaml", tmp_path)
    with pytest.raises(FileNotFoundError, match=r"scene0001\.yaml does not exist"):
        read_motion_bench_maker(tmp_path)
