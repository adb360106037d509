"""Every example runs, and what it prints is right."""

import contextlib
import io
import re
import runpy
from pathlib import Path

import pytest

from support.busy_machine import unless_held_up

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(number: str) -> str:
    (path,) = EXAMPLES.glob(f"{number}_*.py")
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        runpy.run_path(str(path), run_name="__main__")
    return output.getvalue()


def number_after(text: str, output: str) -> float:
    found = re.search(re.escape(text) + r"\s*(-?[\d.]+(?:e[+-]?\d+)?)", output)
    assert found is not None, f"no number after {text!r} in:\n{output}"
    return float(found[1])


def test_01_every_link_has_its_gaussians() -> None:
    output = run("01")
    assert "fr3_arm: 7 joints" in output
    assert number_after("in all:", output) == 32  # 8 links with meshes, 4 each


def test_02_derivatives_agree() -> None:
    output = run("02")
    # Rounding of the differences (1e-16 / h^2 = 1e-10, relative to a curvature of 10) leaves this much.
    assert number_after("error of dpsi/dt:", output) < 1e-8
    assert number_after("error of d2psi/dt2:", output) < 1e-6
    assert number_after("dense Christoffel symbols:", output) < 1e-6


def test_03_arm_goes_around() -> None:
    output = run("03")
    assert "joint error 0.000095 rad" in output  # the C++ twin prints the same
    assert number_after("straight line: smallest clearance", output) < 0.0
    assert number_after("around: smallest clearance", output) > 0.1


@pytest.mark.slow
def test_04_torque_control_arrives_within_limits() -> None:
    output = run("04")
    assert "reached: True" in output
    assert "contacts: 0" in output
    assert "limits kept: True" in output
    assert number_after("smallest clearance", output) > 0.0
    assert number_after("largest error of the model:", output) < 1e-6


def test_05_velocities_enter_the_curvature() -> None:
    output = run("05")
    exact, difference = number_after("at rest:", output), number_after("by finite differences", output)
    assert exact == pytest.approx(difference, rel=1e-5)  # printed to six digits
    assert number_after("joint error", output) < 0.01
    assert number_after("smallest clearance", output) > 0.1


def test_06_merged_points_cover_the_cloud() -> None:
    output = run("06")
    assert output.startswith("5000 points in the file")
    assert number_after("in the file,", output) < 500
    assert "every point is covered: True" in output


def test_examples_are_short_and_say_what_they_show() -> None:
    for path in sorted(EXAMPLES.glob("[0-9]*.py")):
        text = path.read_text(encoding="utf-8")
        assert text.startswith('"""'), path.name
        assert len(text.splitlines()) < 80, path.name


def test_07_the_controller_arrives(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(EXAMPLES.parent)
    output = run("07")
    assert output.startswith("arrived, torque there up to ")
    assert 0.0 < number_after("torque there up to", output) < 19.44  # [Nm] limit of the first joint


def test_07_is_as_short_as_it_says() -> None:
    """Lines that say something: at most 8 of Python, 20 of C++."""
    for name, comment, most in (
        ("07_hello_controller.py", "#", 8),
        ("cpp/07_hello_controller.cpp", "//", 20),
    ):
        text = (EXAMPLES / name).read_text(encoding="utf-8").split('"""')[-1]
        lines = [line for line in text.splitlines() if line.strip() and not line.strip().startswith(comment)]
        assert len(lines) <= most, name


def test_08_the_filter_keeps_off_the_ball() -> None:
    output = run("08")
    assert number_after("clearance at least", output) > 0.0


def test_09_the_hand_has_its_twist() -> None:
    numbers = [float(x) for x in re.findall(r"-?\d+\.\d*", run("09"))]
    assert numbers == pytest.approx([0.0, 0.1, 0.0, 0.0, 0.0, 0.2], abs=0.005)


def test_10_the_trajectory_arrives_on_its_path() -> None:
    output = run("10")
    assert "arrived" in output
    assert number_after("at most", output) < 1.0  # [mrad]


def test_11_the_plant_arrives_and_its_rotors_are_found() -> None:
    output = run("11")
    assert output.startswith("arrived")
    assert 0.03 < number_after("rotors up to", output) <= 0.12  # [kg m²]; there are 0.1


@pytest.mark.parametrize("number", ["08", "09", "10", "11"])
def test_hello_worlds_have_at_most_12_lines(number: str) -> None:
    """Of C++ without includes, `main` and closing braces."""
    (path,) = EXAMPLES.glob(f"{number}_*.py")
    lines = [line for line in path.read_text(encoding="utf-8").split('"""')[-1].splitlines() if line.strip()]
    assert len(lines) <= 12
    (path,) = (EXAMPLES / "cpp").glob(f"{number}_*.cpp")
    lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]
    left_out = ("//", "#include", "int main")
    assert len([line for line in lines if line not in ("", "}") and not line.startswith(left_out)]) <= 12


@pytest.mark.slow
def test_12_the_arm_goes_around_what_the_camera_sees() -> None:
    pytest.importorskip("mujoco")
    output = run("12")
    assert output.startswith("arrived after ")
    assert number_after("contacts:", output) == 0
    text = (EXAMPLES / "12_camera.py").read_text(encoding="utf-8")
    program = text.split("camera = DepthCamera")[1]  # what is not the world that stands for a real one
    assert len([line for line in program.splitlines() if line.strip()]) <= 15


@pytest.mark.slow
def test_12_without_the_camera_the_arm_hits_the_box() -> None:
    """The box stands in the way, or the example would show nothing."""
    pytest.importorskip("mujoco")
    text = (EXAMPLES / "12_camera.py").read_text(encoding="utf-8")
    images = "perception.update(image.camera, image.depth, time=image.time)"
    assert images in text
    made = "perception = Perception(controller, [camera])"
    assert made in text
    blind = text.replace(images, "pass").replace(made, "controller.set_obstacles(ss.Obstacles.none())")
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(
            blind.replace("touched += data.ncon", "touched += data.ncon\n    if touched:\n        break"), {}
        )
    assert number_after("contacts:", output.getvalue()) > 0


def test_13_a_driver_of_ones_own_arrives() -> None:
    assert unless_held_up(lambda: run("13"), str) == "arrived the arm is at its goal\n"
    text = (EXAMPLES / "13_a_driver_of_your_own.py").read_text(encoding="utf-8")
    driver = text.split("class JsonRobot")[1].split("def stand_in")[0]
    assert len(driver.splitlines()) <= 60
