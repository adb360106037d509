"""A scenario: everything that is needed to repeat one run, as a YAML file."""

from __future__ import annotations

import dataclasses
import os
import types
import typing
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import yaml

from sidestep.scenario.config import MAX_LOOK_STEPS, Section, check_steps, section_of, value_in
from sidestep.scenario.shape import ObstacleShape, PointSource, document_of, shape_of
from sidestep.scenario.validation import MAX_CHARACTERS, ScenarioError, check_document, parse_yaml
from sidestep.shapes import Shape, Sphere
from sidestep.storage.whole_file import write_text

Vector3 = tuple[float, float, float]
Locked = dict[str, float | str | tuple[float, float]]  # values, names of postures, ranges
Mode = Literal["torque", "kinematic"]
SwitchType = Literal["none", "harmonic_only", "geodesic_only", "binary", "sigmoid", "distance"]

FORMAT_VERSION = 1
MAX_STEPS = 2_000_000  # of one run: ten minutes at 0.3 ms; every step is kept for the report
MethodChoice = Literal["custom", "controller", "barrier", "reactive"]


@dataclass(frozen=True)
class BasePose:
    """Pose of the robot's base in the world: position [m], roll, pitch, yaw about fixed x, y, z [deg]."""

    position: Vector3
    rotation_deg: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RobotConfig:
    """A robot by name or by URDF file, with the joints `locked` at a value [rad | m], at that of a posture or within a
    range; by file with a `tip`, a `base`, and limits by joint as well.

    effort_limits [Nm | N], velocity_limits [rad/s | m/s]: in place of those of the file.
    """

    name: str | None = None
    urdf: str | None = None
    package_dirs: tuple[str, ...] = ()
    tip: str | None = None
    locked: Locked | None = None
    base: BasePose | None = None
    effort_limits: dict[str, float] | None = None
    velocity_limits: dict[str, float] | None = None


@dataclass(frozen=True)
class JointState:
    """Joint coordinates (nv,) in `unit` ("deg" or "rad"; prismatic coordinates are always in metres)."""

    unit: Literal["deg", "rad"]
    position: tuple[float, ...]
    velocity: tuple[float, ...] | None = None


@dataclass(frozen=True)
class PoseConfig:
    """Pose of a frame of the robot in the world: position [m], roll, pitch, yaw about fixed x, y, z [deg].

    posture: a configuration that the joints are drawn to as well; left out: one with that pose, found from the start.
    """

    frame: str
    position: Vector3
    rotation_deg: Vector3
    posture: JointState | None = None


@dataclass(frozen=True)
class BodyConfig:
    """How the Gaussian mixtures of the links are fitted; of the controller, how many ellipsoids cover each link.

    ellipsoids: left out: as many as it takes. draft: of the controller, a coarser body in seconds.
    """

    components: int | Literal["aic", "bic"] | dict[str, int] = 4
    covariance: Literal["spherical", "diagonal", "full"] = "full"
    seed: int = 0
    ellipsoids: int | None = None
    draft: bool = False


@dataclass(frozen=True)
class StraightMove:
    """From the obstacle's position to `to` [m], at constant speed between `begin` and `end` [s]."""

    to: Vector3
    begin: float
    end: float


@dataclass(frozen=True)
class Obstacle:
    """One obstacle: what it is, where, how it moves, and what the controller sees of it."""

    shape: ObstacleShape
    position: Vector3
    name: str | None = None
    rotation_deg: Vector3 = (0.0, 0.0, 0.0)
    velocity: Vector3 = (0.0, 0.0, 0.0)
    motion: StraightMove | None = None
    free: bool = False
    points: Literal["centre", "ball", "surface"] = "centre"
    spacing: float = 0.03
    excess: float = 0.002


@dataclass(frozen=True)
class JointLimitConfig:
    """Slope and height of the joint-limit potential (thesis, equation 5.7)."""

    slope: float = 30.0
    height: float = 1.0


@dataclass(frozen=True)
class EmbeddingConfig:
    """The extra coordinates of the embedded joint space."""

    density: Literal["sum", "average"] = "sum"
    joint_limits: JointLimitConfig | None = None
    combine: Literal["sum", "stack"] = "sum"


@dataclass(frozen=True)
class SwitchConfig:
    """Between the harmonic and the geodesic term: threshold of psi, or of each link's distance [m]."""

    type: SwitchType = "none"
    threshold: float | None = None
    thresholds: tuple[float, ...] | None = None
    slope: float | None = None


@dataclass(frozen=True)
class SystemConfig:
    """Stiffness, damping and switch of the dynamical system."""

    stiffness: float = 0.5
    damping: float = 1.5
    damping_form: Literal["plain", "metric"] = "plain"
    switch: SwitchConfig = field(default_factory=SwitchConfig)


@dataclass(frozen=True)
class SimulationConfig:
    """How the run is simulated: mode, control period [s], longest time [s], integrator, tolerance [rad]; a pose also
    has to be reached within 1 cm."""

    mode: Mode = "torque"
    period: float = 0.001
    duration: float = 15.0
    integrator: Literal["semi_implicit_euler", "second_order", "runge_kutta_4"] = "semi_implicit_euler"
    tolerance: float = 0.05


@dataclass(frozen=True)
class Scenario:
    """One run of one arm, as written in a scenario file (`sidestep schema` prints the format).

    Args:
        name: letters, digits, dot, dash, underscore.
        method: "custom": body, embedding and system as this file says; in place of them the `Controller`, which sees
            the real size of the obstacles: "controller", "barrier" (without planner), "reactive" (without planner, look
            ahead and sub-goals).
        robot, start, goal, body, obstacles, embedding, system, simulation: the parts, see their classes.
        controller: what differs from the defaults of `ControllerSettings`, as a mapping of its tree where None leaves a
            part out: {"barriers": {"activation": 0.2}, "planner": None}. Method "custom": of the torque program.
        description, source: what happens, and where it comes from.
        folder: what relative file names refer to; not part of the file.
    """

    name: str
    robot: RobotConfig
    start: JointState
    goal: JointState | PoseConfig
    description: str = ""
    source: str = ""
    method: MethodChoice = "custom"
    body: BodyConfig = field(default_factory=BodyConfig)
    obstacles: tuple[Obstacle, ...] = ()
    embedding: EmbeddingConfig = field(default_factory=EmbeddingConfig)
    system: SystemConfig = field(default_factory=SystemConfig)
    controller: Section = field(default_factory=dict)
    simulation: SimulationConfig = field(default_factory=SimulationConfig)
    folder: Path = field(default_factory=Path.cwd, compare=False, repr=False)

    @classmethod
    def load(cls, source: str | Path) -> Scenario:
        """Read a scenario file, or a shipped scenario by its name.

        Args:
            source: path of a YAML file, or one of `shipped_scenarios()`.

        Raises:
            FileNotFoundError: neither a file nor a shipped scenario; the message lists the shipped ones.
            ScenarioError: not a valid scenario; the message names the file, the place and the value.
        """
        path = Path(source)
        if not path.is_file():
            shipped = shipped_scenarios()
            if str(source) not in shipped:
                raise FileNotFoundError(
                    f"no scenario {str(source)!r}: no such file; shipped scenarios are {', '.join(shipped)}"
                )
            path = _shipped_folder() / f"{source}.yaml"
        try:
            if path.stat().st_size > 4 * MAX_CHARACTERS:  # bytes of a character
                raise ScenarioError(
                    f"{path}: has {path.stat().st_size} bytes; at most {MAX_CHARACTERS} characters are allowed"
                )
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ScenarioError(f"{path}: cannot be read as UTF-8 text: {error}") from error
        return cls.from_text(text, file=str(path), folder=path.resolve().parent)

    @classmethod
    def from_text(cls, text: str, *, file: str = "scenario", folder: Path | None = None) -> Scenario:
        """The scenario in a YAML text; `file` is its name in error messages.

        Raises:
            ScenarioError: the text is not a valid scenario.
        """
        document = parse_yaml(text, file=file)
        check_document(document, file=file)
        document.pop("format")
        section = section_of(document.pop("controller", {}))
        scenario: Scenario = dataclasses.replace(_build(cls, document), controller=section)
        try:
            scenario.check_steps()
        except ValueError as error:
            raise ScenarioError(f"{file}: {error}") from None
        for index, item in enumerate(scenario.obstacles):
            if item.motion is not None and not item.motion.begin < item.motion.end:
                raise ScenarioError(
                    f"{file}: obstacles[{index}].motion: end is {item.motion.end}; it must be after begin "
                    f"({item.motion.begin})"
                )
            if (item.motion is not None or any(item.velocity)) and item.free:
                raise ScenarioError(
                    f"{file}: obstacles[{index}].free is true; a free obstacle starts at rest: leave out "
                    "velocity and motion"
                )
            if item.motion is not None and any(item.velocity):
                raise ScenarioError(f"{file}: obstacles[{index}]: give either velocity or motion, not both")
            if item.points == "ball" and not isinstance(item.shape, Sphere | PointSource):
                raise ScenarioError(
                    f"{file}: obstacles[{index}].points is 'ball'; a {item.shape.kind} allows centre, surface"
                )
            cloud = isinstance(item.shape, PointSource)
            if item.free and (cloud or (isinstance(item.shape, Shape) and not item.shape.bounded)):
                kind = "point cloud" if cloud else item.shape.kind
                raise ScenarioError(f"{file}: obstacles[{index}].free is true; a {kind} can only be fixed")
        return dataclasses.replace(scenario, folder=folder or Path.cwd())

    def check_steps(self) -> None:
        """Raises ValueError where a run, or a look ahead in it, would take more steps than anybody waits for."""
        run = self.simulation
        check_steps("simulation", run.period, "duration", run.duration, MAX_STEPS)
        period, horizon = (value_in(self.controller, f"look_ahead.{name}") for name in ("period", "horizon"))
        check_steps("controller.look_ahead", period, "horizon", horizon, MAX_LOOK_STEPS)

    def to_document(self) -> dict[str, Any]:
        """The scenario as plain dictionaries and lists, as in the file, without what equals the default."""
        return {"format": FORMAT_VERSION, **_plain(self)}

    def save(self, path: str | Path) -> None:
        """Write the scenario as YAML, whole or not at all; file names in it stay valid from the new place."""
        target = Path(path).resolve()
        document = self._moved_to(target.parent).to_document()
        text = yaml.safe_dump(
            document, sort_keys=False, allow_unicode=True, width=110, default_flow_style=None
        )
        write_text(target, text)

    def file(self, name: str) -> Path:
        """The path of a file that the scenario names."""
        return (self.folder / name).resolve()

    def _moved_to(self, folder: Path) -> Scenario:
        if folder == self.folder.resolve():
            return self

        def moved(name: str) -> str:
            return Path(os.path.relpath(self.file(name), folder)).as_posix()

        robot = self.robot
        if robot.urdf is not None:
            robot = dataclasses.replace(
                robot, urdf=moved(robot.urdf), package_dirs=tuple(moved(d) for d in robot.package_dirs)
            )
        obstacles = tuple(
            o if isinstance(o.shape, Shape)
            else dataclasses.replace(o, shape=dataclasses.replace(o.shape, file=moved(o.shape.file)))
            for o in self.obstacles
        )  # fmt: skip
        return dataclasses.replace(self, robot=robot, obstacles=obstacles, folder=folder)


def shipped_scenarios() -> tuple[str, ...]:
    """Names of the scenarios that come with the package."""
    return tuple(sorted(p.stem for p in _shipped_folder().glob("*.yaml")))


def _shipped_folder() -> Path:
    return Path(str(resources.files("sidestep.scenario"))) / "shipped"


def _build(kind: Any, value: Any) -> Any:
    """The value of a checked document as the annotated type: mappings to dataclasses, lists to tuples."""
    if kind == ObstacleShape:
        return shape_of(value)
    if isinstance(kind, types.UnionType):
        if value is None:
            return None
        for option in kind.__args__:
            is_tuple = typing.get_origin(option) is tuple
            if _has_all(option, value) or (is_tuple and isinstance(value, list)):
                return _build(option, value)
        return _numbers(value, kind.__args__)
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        return kind(**{key: _build(hints[key], item) for key, item in value.items()})  # type: ignore[operator]
    if typing.get_origin(kind) is tuple:
        item_kind = typing.get_args(kind)[0]
        return tuple(_build(item_kind, item) for item in value)
    return _numbers(value, (kind,))


def _has_all(kind: Any, value: Any) -> bool:
    """Whether a mapping has every key that a dataclass must have."""
    return dataclasses.is_dataclass(kind) and all(
        entry.name in value
        for entry in dataclasses.fields(kind)
        if entry.default is dataclasses.MISSING and entry.default_factory is dataclasses.MISSING
    )


def _numbers(value: Any, kinds: tuple[Any, ...]) -> Any:
    if isinstance(value, dict):
        if Locked in kinds:
            return {k: _locked(v) for k, v in value.items()}
        return {k: float(v) if dict[str, float] in kinds else int(v) for k, v in value.items()}
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value) if float in kinds else int(value) if int in kinds else value
    return value


def _locked(value: Any) -> float | str | tuple[float, ...]:
    """A value, the name of a posture, or a range."""
    if isinstance(value, list):
        return tuple(float(bound) for bound in value)
    return value if isinstance(value, str) else float(value)


def _plain(value: Any) -> Any:
    """The reverse of _build, without what equals the default."""
    if isinstance(value, ObstacleShape):
        return document_of(value)
    if dataclasses.is_dataclass(value):
        plain: dict[str, Any] = {}
        for entry in dataclasses.fields(value):
            item = getattr(value, entry.name)
            factory = entry.default_factory
            default = entry.default if factory is dataclasses.MISSING else factory()
            if entry.compare and item != default:
                plain[entry.name] = _plain(item)
        return plain
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return dict(value) if isinstance(value, dict) else value
