"""What is no real number is not taken for one, in the bindings and in front of them."""

import warnings

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import real_array
from sidestep.obstacles import merge_in_voxels
from sidestep.system import GeometricSystem

NO_NUMBERS = {
    "complex": np.array([0.1 + 2.0j, 0.2]),
    "bool": np.array([True, False]),
    "datetime": np.array(["2024-01-01", "2024-01-02"], dtype="datetime64[D]"),
    "timedelta": np.array([1, 2], dtype="timedelta64[s]"),
    "object": np.array([0.1, None], dtype=object),
    "text": np.array(["0.1", "0.2"]),
    "bytes": np.array([b"0.1", b"0.2"]),
    "list of complex": [0.1, 2.0j],
    "list with None": [0.1, None],
}
MASKED = np.ma.MaskedArray([0.1, 0.2], mask=[False, True])


@pytest.fixture(scope="module")
def robot() -> ss.Robot:
    return ss.Robot.named("planar2")


@pytest.fixture(autouse=True)
def no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("value", NO_NUMBERS.values(), ids=NO_NUMBERS)
def test_other_types_are_refused_with_the_name_of_the_argument(robot, value):
    system, none, q = GeometricSystem([], robot=robot), ss.Obstacles.none(), np.zeros(2)
    calls = {
        "q": lambda: system.acceleration(value, q, q, none),
        "goal": lambda: system.acceleration(q, q, value, none),
        "stiffness": lambda: GeometricSystem([], robot=robot, stiffness=value),
        "radii": lambda: ss.Obstacles(np.zeros((2, 3)), radii=value),
        "v": lambda: robot.bias(q, value),
    }
    for name, call in calls.items():
        with pytest.raises(TypeError, match=f"{name}.* must be an array of real numbers"):
            call()
    with pytest.raises(TypeError, match="q must be an array of real numbers"):
        robot.check_configuration(value)


def test_the_error_names_the_type():
    with pytest.raises(TypeError, match=r"p must be an array of real numbers.*has dtype complex128"):
        real_array(np.zeros(2, dtype=complex), "p")
    with pytest.raises(TypeError, match=r"has dtype datetime64\[D\]"):
        real_array(NO_NUMBERS["datetime"], "p")


@pytest.mark.parametrize("value", [MASKED, [MASKED, MASKED], [0.1, np.ma.masked], (0.1, [np.ma.masked])])
def test_masked_entries_are_refused(value):
    with pytest.raises(ValueError, match="p has masked entries"):
        real_array(value, "p")


def test_masked_entries_are_refused_by_the_functions(robot):
    system, none, q = GeometricSystem([], robot=robot), ss.Obstacles.none(), np.zeros(2)
    with pytest.raises(ValueError, match="q has masked entries"):
        system.acceleration(MASKED, q, q, none)
    with pytest.raises(ValueError, match="radii has masked entries"):
        ss.Obstacles(np.zeros((2, 3)), radii=MASKED)
    with pytest.raises(ValueError, match="points has masked entries"):
        merge_in_voxels(np.ma.MaskedArray(np.zeros((2, 3)), mask=np.eye(2, 3)), 0.0, voxel=0.1)


@pytest.mark.parametrize(
    "value",
    [
        np.ma.MaskedArray([1.0, 2.0]),
        [1, 2],
        (1.0, np.float32(2.0)),
        np.array([1, 2], dtype=np.uint8),
        np.array([1.0, 2.0], dtype=">f8"),
        np.array([1.0, 7.0, 2.0])[::2],
        np.array([1.0, 2.0], dtype=np.float16),
    ],
)
def test_real_numbers_of_every_kind_are_taken(robot, value):
    found = real_array(value, "p")
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, [1.0, 2.0])
    assert ss.JointGoal(value).position.tolist() == [1.0, 2.0]


def test_numbers_are_taken_as_scalars(robot):
    for number in (2, 2.0, np.float64(2.0), np.float32(2.0), np.int64(2), np.array(2.0)):
        np.testing.assert_array_equal(
            GeometricSystem([], robot=robot, stiffness=number).stiffness, 2.0 * np.eye(2)
        )
    for number in (True, np.bool_(True), 2.0 + 1.0j, np.complex128(2.0), np.timedelta64(2, "s"), "2"):
        with pytest.raises(TypeError, match="stiffness must be an array of real numbers"):
            GeometricSystem([], robot=robot, stiffness=number)


def test_an_array_of_float64_is_not_copied():
    array = np.arange(3.0)
    assert np.shares_memory(real_array(array, "p"), array)
