"""The arm: everything that is prepared once for a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from sidestep import _core
from sidestep.arm.summary import summary_of
from sidestep.arm.telling import Telling, somebody_watches
from sidestep.extras import MissingExtraError
from sidestep.shipped_arms import SUFFIX, shipped_file

if TYPE_CHECKING:  # imported where they are used: a prepared arm loads without them
    from sidestep.arm.preparation import Progress
    from sidestep.body import Body
    from sidestep.robot import Robot
    from sidestep.robot.limits import LimitValues
    from sidestep.robot.source import XacroValue


class Arm(_core.Arm):
    """Everything that is prepared once for a robot, in one object and one file that C++ can read without Python.

    Make one with `load` or `from_robot`; `save` writes it. It is immutable.

    Attributes:
        name: of the robot. num_coordinates: joint coordinates nv.
        limits: position, velocity, acceleration and effort (`JointLimits`).
        neutral: a configuration (nv,) inside the limits.
        pairs: links that must not touch, without a table: (first, second, contact [m]).
        tables: `ClearanceTable` of the other pairs.
        inertials: one per joint; empty if the description lacks them (`has_dynamics`).
        proof: what is proven and measured of the ellipsoids of each link.
        allowed_pairs: links that may touch.
        provenance: description, fingerprint, version and date it was prepared from.
        content_hash: SHA-256 (64 hex digits) of everything but the provenance.
    """

    def __init__(self, arm: _core.Arm, *, description: Callable[[], Robot] | None = None) -> None:
        """Wraps an arm of the core.

        Args:
            arm: of the core. description: gives the robot with its meshes when `robot` is first asked for.
        """
        super().__init__(arm)
        self._description = description
        self._request: tuple[str | Path, Mapping[str, Any]] | None = (
            None  # what it can be prepared from again
        )
        self._is_draft = False

    @classmethod
    def load(
        cls,
        source: str | Path,
        *,
        package_dirs: Sequence[str | Path] = (),
        base_pose: ArrayLike | None = None,
        tip: str | None = None,
        locked: Mapping[str, ArrayLike] | None = None,
        locked_beyond_limits: bool = False,
        acceleration_limits: LimitValues | None = None,
        velocity_limits: LimitValues | None = None,
        effort_limits: LimitValues | None = None,
        jerk_limits: LimitValues | None = None,
        effort_rate_limits: LimitValues | None = None,
        name: str | None = None,
        xacro_arguments: Mapping[str, XacroValue] | None = None,
        srdf: str | Path | None = None,
        allowed: Sequence[tuple[str, str]] = (),
        components: Mapping[str, int] | None = None,
        draft: bool = False,
        progress: Progress | None = None,
        cache: bool = True,
    ) -> Arm:
        """An arm by the name of a shipped robot, from an `.arm` file, or from a robot description.

        A shipped name without options is read from the file that comes with Sidestep, in milliseconds and without any
        robot package. A description, or a name with options, is prepared on first use. That takes minutes; the user's
        cache keeps the result.

        Args:
            source: a name of `sidestep.robots()`, the path of an `.arm` file, or a URDF, xacro or MJCF file
                (or its text); or a name of the packages `robot_descriptions` or `mujoco_menagerie`, where those are
                installed.
            package_dirs, base_pose, tip, name: of a description, as in `Robot.from_urdf`; so are the rest up to `srdf`.
            locked, locked_beyond_limits: as there; of a name as in `Robot.named`, which takes these two alone.
            acceleration_limits, velocity_limits, effort_limits, jerk_limits, effort_rate_limits: as there.
            xacro_arguments, srdf: as there.
            allowed: pairs of links that may touch, beside those of the description: they get no clearance.
            components: ellipsoids of links that work close to things, {link: number}, such as {"hand": 24}: they
                overshoot less than by default, and cost more. A draft does without.
            draft: prepare a draft body in seconds, until the fine body is there, see `Refinement`. It is proven to
                cover the arm like the fine one, but has fewer and larger ellipsoids, so the arm keeps farther away. If
                the user's cache has the fine arm, that is used.
            progress: called as progress(stage, item, done, in_all) while an arm is prepared; the stage is "cover",
                "tables" or "pairs", the item a link or a pair of links. By default at a terminal and in a notebook a
                line on stderr tells how far it is, and then the `summary`; elsewhere nothing does.
            cache: whether to read prepared parts from the user's cache and write them there (SIDESTEP_CACHE_DIR
                overrides its place): the arm, the cover of each link, and the table and contact of each pair of links.
                Other arms share them.

        Raises:
            FileNotFoundError: there is no such file, or a named robot's package is not installed.
            ValueError: an unknown name, a damaged file, an option that does not suit the source, anything wrong in the
                description.
        """
        options: dict[str, Any] = {
            "package_dirs": package_dirs,
            "base_pose": base_pose,
            "tip": tip,
            "locked": locked,
            "locked_beyond_limits": locked_beyond_limits,
            "acceleration_limits": acceleration_limits,
            "velocity_limits": velocity_limits,
            "effort_limits": effort_limits,
            "jerk_limits": jerk_limits,
            "effort_rate_limits": effort_rate_limits,
            "name": name,
            "xacro_arguments": xacro_arguments,
            "srdf": srdf,
        }
        given = {key: value for key, value in options.items() if not _is_default(value)}
        text = isinstance(source, str) and source.lstrip().startswith("<")
        path = Path("URDF text" if text else source)
        if not text and path.suffix.lower() == SUFFIX:
            also = [*(["allowed"] if allowed else []), *(["components"] if components else [])]
            if refused := [*given, *also]:
                raise ValueError(f"{refused[0]} cannot be given for arm file '{path}', which is prepared")
            return cls(_core.Arm.read(path))

        def describe() -> Robot:
            from sidestep.robot.any_source import robot_from

            return robot_from(source, given)

        shipped = None if given or allowed or components else shipped_file(str(source))
        if shipped is not None and not path.is_file():
            arm = cls(_core.Arm.read(shipped), description=describe)
            arm._request = source, given
            return arm
        telling = Telling(path.name) if progress is None and somebody_watches() else None
        how = _How(tuple(allowed), dict(components or {}), draft, telling or progress, cache)
        arm = cls._prepared(describe, path.name, how, (source, given))
        if telling is not None:
            telling.end(arm.summary())
        return arm

    @classmethod
    def from_robot(
        cls,
        robot: Robot,
        body: Body | None = None,
        *,
        allowed: Sequence[tuple[str, str]] = (),
        progress: Progress | None = None,
    ) -> Arm:
        """Prepares an arm for a robot at hand: minutes, unless the user's cache has the parts.

        Args:
            robot: with geometry.
            body: a covering body of it; `Body.cover(robot)` by default. With a draft, `Body.cover(robot,
                effort="draft")`, tables and pairs are those of a draft too.
            allowed: pairs of links that may touch: they get no clearance.
            progress: as in `load`.

        Raises:
            ValueError: names what is wrong: a body that does not cover, or belongs to another robot, an unknown link.
        """
        from sidestep.arm.preparation import prepare

        arm = prepare(robot, body=body, allowed=allowed, progress=progress)
        return cls(arm, description=lambda: robot)

    def __repr__(self) -> str:
        return f"Arm({self.name!r}, {self.num_coordinates} coordinates, {self.content_hash[:12]})"

    @property
    def is_draft(self) -> bool:
        """Whether it was prepared in seconds, and a `Refinement` makes a finer one."""
        return self._is_draft

    @property
    def robot(self) -> _core.Robot:
        """The kinematic tree; a `Robot` with meshes where the arm comes from a robot, a description or a name.

        Of an `.arm` file it has no meshes. So it is where the extra `prepare` or the robot's package is not installed,
        and where that has other meshes by now. What needs meshes says then why there are none.
        """
        return self._robot

    def summary(self) -> str:
        """What was read and prepared, for people: joints with their limits, reach, mass, tip, and what was assumed."""
        return summary_of(_core.Arm(self), draft=self.is_draft)

    def __str__(self) -> str:
        return self.summary()

    def __reduce__(self) -> tuple[Any, ...]:
        """By the content, and by what it was prepared from; an arm of `from_robot` comes back without meshes."""
        return _restored, (self.__getstate__(), self._request, self._is_draft)

    @cached_property
    def body(self) -> Body:
        """The covering body, with what is proven and measured of each link (`link_covers`)."""
        from sidestep.body import Body

        return Body.of_arm(_core.Arm(self))

    def mass_matrix(self, q: ArrayLike) -> npt.NDArray[np.float64]:
        """Joint-space inertia M(q) (nv, nv) [kg m^2, kg m, kg] at q (nv,); without rotor inertias.

        Raises:
            ValueError: the arm has no inertias; a wrong shape; a number that is not finite.
        """
        return self._dynamics.mass_matrix(q)

    def bias(self, q: ArrayLike, v: ArrayLike) -> npt.NDArray[np.float64]:
        """Coriolis, centrifugal and gravity force (nv,) [Nm | N] at q, v (nv,), gravity 9.81 m/s^2 along -z.

        h(q, v) = C(q, v) v + g(q), so that M(q) a + h(q, v) = torque; no friction.

        Raises:
            ValueError: the arm has no inertias; a wrong shape; a number that is not finite.
        """
        return self._dynamics.bias(q, v)

    @cached_property
    def _dynamics(self) -> _core.RigidBodyDynamics:
        if not self.has_dynamics:
            raise ValueError(f"arm {self.name!r} has no inertias: its description lacks <inertial>")
        return _core.RigidBodyDynamics(super().robot, self.inertials)

    @cached_property
    def _robot(self) -> _core.Robot:
        core = super().robot
        if self._description is None:
            return RobotWithoutMeshes(core, "an .arm file has none; load the robot's description for them")
        try:
            robot = self._description()
        except (MissingExtraError, FileNotFoundError) as error:
            return RobotWithoutMeshes(core, str(error))
        if robot.fingerprint != self.provenance.fingerprint:
            return RobotWithoutMeshes(
                core, "the installed description is another one than it was prepared from"
            )
        return robot

    @classmethod
    def _prepared(
        cls,
        describe: Callable[[], Robot],
        label: str,
        how: _How,
        request: tuple[str | Path, Mapping[str, Any]],
    ) -> Arm:
        from sidestep.arm.cache import arm_path, stored_or_made
        from sidestep.arm.preparation import prepare
        from sidestep.body.sampling import check_components, links_with_geometry

        robot = describe()
        if how.components:
            links = links_with_geometry(robot)
            check_components({**dict.fromkeys(links, 1), **how.components}, links)
        allowed = tuple(dict.fromkeys((*robot.allowed_pairs, *how.allowed)))
        fine = arm_path(robot, allowed, label, components=how.components)
        draft = how.draft and not (how.cache and fine.exists())

        def make() -> _core.Arm:
            return prepare(
                robot,
                allowed=allowed,
                source=label,
                draft=draft,
                components=None if draft else how.components,
                cached=how.cache,
                progress=how.progress,
            )

        made = (
            stored_or_made(arm_path(robot, allowed, label, draft) if draft else fine, make)
            if how.cache
            else make()
        )
        arm = cls(made, description=lambda: robot)
        arm._request = request[0], {**request[1], "allowed": how.allowed, "components": how.components}
        arm._is_draft = draft
        return arm


class RobotWithoutMeshes(_core.Robot):
    """The kinematic tree of an arm whose meshes are not here; what needs them is told why.

    Args:
        core: the tree. reason: why there are no meshes.
    """

    def __init__(self, core: _core.Robot, reason: str) -> None:
        super().__init__(
            core.name,
            joints=core.joints,
            frames=core.frames,
            coordinate_names=core.coordinate_names,
            limits=core.limits,
        )
        self.reason = reason

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(f"robot {self.name!r} has no {name!r}, because it has no meshes: {self.reason}")


def _restored(content: bytes, request: tuple[str | Path, Mapping[str, Any]] | None, is_draft: bool) -> Arm:
    """A pickled arm; its description is read again when meshes are asked for."""
    core = _core.Arm.__new__(_core.Arm)
    core.__setstate__(content)
    describe = None
    if request is not None:
        source, given = request
        own = {key: value for key, value in given.items() if key not in ("allowed", "components")}

        def describe() -> Robot:
            from sidestep.robot.any_source import robot_from

            return robot_from(source, own)

    arm = Arm(core, description=describe)
    arm._request, arm._is_draft = request, is_draft
    return arm


@dataclass(frozen=True)
class _How:
    """How an arm is prepared, see `Arm.load`."""

    allowed: tuple[tuple[str, str], ...]
    components: Mapping[str, int]
    draft: bool
    progress: Progress | None
    cache: bool


def _is_default(value: object) -> bool:
    return value is None or value is False or (isinstance(value, tuple | list | dict) and not value)
