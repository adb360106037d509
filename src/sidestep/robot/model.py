"""The robot: the core's kinematic tree with links, meshes, limits and dynamics around it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from sidestep import _core
from sidestep.robot import catalogue
from sidestep.robot.configurations import checked, finite_interval, finite_vector, random_configurations
from sidestep.robot.descriptions import described
from sidestep.robot.fingerprint import fingerprint_of
from sidestep.robot.limits import LimitValues
from sidestep.robot.link import Array, Geometry, Link
from sidestep.robot.mjcf import is_mjcf, no_mjcf, read_mjcf, warn_of_defaults
from sidestep.robot.plausibility import arm_length, warn_of_sizes
from sidestep.robot.source import XacroValue, read_description
from sidestep.robot.srdf import read_extras, read_states, srdf_of
from sidestep.robot.tool import tree_with_tool
from sidestep.robot.tree import KinematicTree, at_postures, build_tree
from sidestep.robot.urdf import parse_urdf

if TYPE_CHECKING:  # imported where they are used: each takes longer to import than a robot to load
    import pinocchio as pin
    import trimesh


class Robot(_core.Robot):
    """An arm read from a URDF or MJCF: kinematics in the core, links with geometry and inertia, limits, dynamics.

    nq = nv = `num_coordinates`: continuous joints are plain angles; mimic joints share the coordinate and the
    limits of their source. Make one with `from_urdf`, `from_mjcf` or `named`.
    """

    def __init__(self, name: str, tree: KinematicTree) -> None:
        super().__init__(
            name,
            joints=list(tree.joints),
            frames=list(tree.frames),
            coordinate_names=list(tree.coordinate_names),
            limits=tree.limits,
        )
        self._links = tree.links
        self._held = dict(tree.held)
        self._postures: dict[str, Array] = {}
        self._allowed_pairs: tuple[tuple[str, str], ...] = ()
        self._link_by_name = {link.name: link for link in tree.links}
        self._meshes: dict[str, trimesh.Trimesh | None] = {}

    @classmethod
    def from_urdf(
        cls,
        source: str | Path,
        *,
        package_dirs: Sequence[str | Path] = (),
        base_pose: ArrayLike | None = None,
        tip: str | None = None,
        locked: Mapping[str, ArrayLike | str] | None = None,
        locked_beyond_limits: bool = False,
        acceleration_limits: LimitValues | None = None,
        velocity_limits: LimitValues | None = None,
        effort_limits: LimitValues | None = None,
        jerk_limits: LimitValues | None = None,
        effort_rate_limits: LimitValues | None = None,
        name: str | None = None,
        xacro_arguments: Mapping[str, XacroValue] | None = None,
        srdf: str | Path | None = None,
    ) -> Robot:
        """Reads a robot from a URDF or xacro file, or from URDF text; an MJCF of any suffix as `from_mjcf` does.

        Joints may be revolute, continuous, prismatic, fixed or mimic, and may branch. Floating and planar joints
        are held at a pose. Mesh files are looked up now and loaded when first used. What other readers of URDF
        accept loads; what was left out, or is implausible, is said in one RuntimeWarning of each kind.

        An SRDF beside the file says which links may touch, and named postures.

        Limits are a number for all joints, one per coordinate (nv,), or `{joint: value}` for some of them. A joint that
        mimics another bounds that one by its own position and velocity limits.

        Args:
            source: a path, or the XML text itself (starts with `<`).
            package_dirs: folders that hold the packages of `package://` references (or are such a package);
                the folders above the URDF are searched too.
            base_pose: pose (4, 4) of the root link in the world, identity by default.
            tip: a link; keeps the joints from the root to it, and links fixed rigidly to links before it.
                What hangs on the tip itself, and every other branch that moves, is dropped.
            locked: joints held at a value [rad | m], or at that of a posture, by the name that the SRDF or a keyframe
                gives it; joints that mimic them are held too, and may be named too.
                Floating and planar joints at a pose (4, 4), or x, y, z [m], roll, pitch, yaw [rad]; where they
                are written by default. Two numbers, a range: something else drives the joint, as a gripper's own
                controller; what it moves is covered wherever it may be, and held in the middle of the range.
            locked_beyond_limits: accept values of `locked` outside the file's limits, as published data has.
            acceleration_limits: [rad/s^2 | m/s^2]; 10 by default (URDF has none).
            velocity_limits: [rad/s | m/s], in place of the file's; none where neither gives one.
            effort_limits: [Nm | N], in place of the file's; none where neither gives one. Torque output needs them.
            jerk_limits: [rad/s^3 | m/s^3]; 100/s times the acceleration limits by default.
            effort_rate_limits: [Nm/s | N/s]; none by default.
            name: in place of the file's.
            xacro_arguments: values of `<xacro:arg>`: texts, numbers, True or False.
            srdf: a file in place of the one beside it.

        Raises:
            FileNotFoundError: the description or a mesh of a collision shape is missing; names every one.
            ValueError: anything wrong in the file or the arguments, named together with what is allowed.
        """
        if is_mjcf(source):
            if package_dirs or xacro_arguments or srdf:
                raise ValueError("package_dirs, xacro_arguments and srdf are of URDF; the file is MJCF")
            mjcf = read_mjcf(source)
            urdf = mjcf.urdf
        else:
            mjcf = None
            urdf = parse_urdf(
                read_description(source, package_dirs=package_dirs, xacro_arguments=xacro_arguments)
            )
        if any(isinstance(value, str) for value in (locked or {}).values()):
            if mjcf is not None:
                states = [(key, dict(values)) for key, values in mjcf.keyframes.items()]
            else:
                file = srdf_of(srdf, source, urdf.name)
                states = read_states(file) if file else []
            locked = at_postures(locked or {}, states)
        tree = build_tree(
            urdf,
            base_pose=base_pose,
            tip=tip,
            locked=locked,
            locked_beyond_limits=locked_beyond_limits,
            acceleration_limits=acceleration_limits,
            velocity_limits=velocity_limits,
            effort_limits=effort_limits,
            jerk_limits=jerk_limits,
            effort_rate_limits=effort_rate_limits,
        )
        robot = cls(name or urdf.name, tree)
        urdf.remarks.warn(urdf.label, stacklevel=2)
        if mjcf is not None:
            robot._take_extras(mjcf.postures(tree.coordinate_names), mjcf.allowed_pairs)
            warn_of_defaults(mjcf, tree.coordinate_names, velocity_limits, effort_limits)
        else:
            extras = read_extras(srdf, source, urdf.name, tree.coordinate_names, robot._link_by_name)
            robot._take_extras(*extras)
        return robot

    @classmethod
    def from_mjcf(
        cls,
        source: str | Path,
        *,
        base_pose: ArrayLike | None = None,
        tip: str | None = None,
        locked: Mapping[str, ArrayLike | str] | None = None,
        locked_beyond_limits: bool = False,
        acceleration_limits: LimitValues | None = None,
        velocity_limits: LimitValues | None = None,
        effort_limits: LimitValues | None = None,
        jerk_limits: LimitValues | None = None,
        effort_rate_limits: LimitValues | None = None,
        name: str | None = None,
    ) -> Robot:
        """Reads a robot from a file of MuJoCo, which must be installed, or from MJCF text.

        The bodies that joints move are the robot, with what they stand on; floors, furniture and free objects are left
        out, with a warning. Bodies and named sites become links below a root link `world`. Ball and free joints are
        held. `<equality><joint>` makes mimic joints, `<exclude>` `allowed_pairs`, `<key>` `postures`. Effort limits are
        those of the actuators. Velocity limits that the file lacks are 2 rad/s and 0.2 m/s, with a warning.

        Args:
            source: a path, or the XML text itself (starts with `<`).
            base_pose: pose (4, 4) of the file's world in the world, identity by default.
            tip, name, locked, locked_beyond_limits: as in `from_urdf`.
            acceleration_limits, velocity_limits, effort_limits, jerk_limits, effort_rate_limits: as there.

        Raises:
            FileNotFoundError: the file or one that it refers to is missing.
            ValueError: MuJoCo refuses the file, nothing in it moves, or an argument is wrong.
            ModuleNotFoundError: MuJoCo is not installed; says how to install it.
        """
        if not is_mjcf(source):
            raise no_mjcf(source)
        return cls.from_urdf(
            source,
            base_pose=base_pose,
            tip=tip,
            locked=locked,
            locked_beyond_limits=locked_beyond_limits,
            acceleration_limits=acceleration_limits,
            velocity_limits=velocity_limits,
            effort_limits=effort_limits,
            jerk_limits=jerk_limits,
            effort_rate_limits=effort_rate_limits,
            name=name,
        )

    @classmethod
    def named(
        cls,
        name: str,
        *,
        locked: Mapping[str, ArrayLike | str] | None = None,
        locked_beyond_limits: bool = False,
    ) -> Robot:
        """One of the robots listed by `sidestep.robots()`, such as "fr3", "fr3_arm", "panda" or "planar2"; or a name of
        the packages `robot_descriptions` ("panda_mj_description") or `mujoco_menagerie`, where they are installed.

        Args:
            name: of the list.
            locked, locked_beyond_limits: as in `from_urdf`; values here replace those of the list.

        Raises:
            ValueError: unknown name, wrong `locked`. FileNotFoundError: its package is not installed; says what
                to install.
        """
        if (file := described(name)) is not None:
            return cls.from_urdf(
                file.path,
                package_dirs=file.package_dirs,
                locked=locked,
                locked_beyond_limits=locked_beyond_limits,
                name=name,
            )
        recipe = catalogue.recipe(name)
        robot = cls.from_urdf(
            recipe.source(),
            tip=recipe.tip,
            locked={**recipe.locked, **(locked or {})},
            locked_beyond_limits=locked_beyond_limits,
            acceleration_limits=recipe.acceleration_limits,
            velocity_limits=recipe.velocity_limits,
            effort_limits=recipe.effort_limits,
            jerk_limits=recipe.jerk_limits,
            effort_rate_limits=recipe.effort_rate_limits,
            name=name,
        )
        robot._allowed_pairs = ()  # an SRDF beside it lets links touch that can: their clearances are known here
        return robot

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.num_coordinates} coordinates, {len(self._links)} links)"

    def with_tool(
        self,
        name: str,
        shape: Geometry | str | Path,
        *,
        link: str,
        pose: ArrayLike | None = None,
        mass: float = 0.0,
    ) -> Robot:
        """This robot with a tool or payload fixed to one of its links, as a link of its own.

        Args:
            name: of the new link.
            shape: a mesh file [m], or a `Geometry` (box, cylinder, sphere, mesh) placed in the tool's frame.
            link: the link that holds it.
            pose: of the tool's frame in the link's frame (4, 4); the link's frame itself by default.
            mass: [kg], spread evenly over the shape (its convex hull if the mesh is open); 0 adds no inertia.

        Raises:
            ValueError: that names the argument and what is allowed. FileNotFoundError: there is no such mesh.
        """
        tree = tree_with_tool(self, self._links, self._held, name, shape, link=link, pose=pose, mass=mass)
        robot = Robot(self.name, tree)
        robot._take_extras(self._postures, self._allowed_pairs)
        return robot

    def _take_extras(self, postures: Mapping[str, Array], allowed_pairs: Sequence[tuple[str, str]]) -> None:
        """Postures and pairs of the description, those pairs alone whose links are here."""
        self._postures = dict(postures)
        self._allowed_pairs = tuple(
            pair for pair in allowed_pairs if all(end in self._link_by_name for end in pair)
        )

    @property
    def postures(self) -> dict[str, Array]:
        """Named configurations (nv,) of the description: keyframes of an MJCF, group states of an SRDF."""
        return {name: q.copy() for name, q in self._postures.items()}

    @property
    def allowed_pairs(self) -> tuple[tuple[str, str], ...]:
        """Links that may touch, by the description: `<exclude>` of an MJCF, or an SRDF."""
        return self._allowed_pairs

    @property
    def links(self) -> tuple[Link, ...]:
        """Every link, in the order of `frames`."""
        return self._links

    @property
    def held(self) -> dict[str, float]:
        """The joints that are locked, with those that mimic them: the position of each [rad | m]."""
        return dict(self._held)

    def link(self, name: str) -> Link:
        """The link called `name`; raises ValueError that lists the links."""
        if name not in self._link_by_name:
            known = ", ".join(self._link_by_name)
            raise ValueError(f"robot {self.name!r} has no link {name!r}; its links are: {known}")
        return self._link_by_name[name]

    def collision_mesh(self, link: str) -> trimesh.Trimesh | None:
        """The surface of a link in its own frame [m]; None for a link without geometry.

        Collision geometry, or the visual geometry of a link that has no collision geometry; several shapes
        are put side by side in one mesh. Loaded once: copy it before you change it.

        Raises:
            ValueError: unknown link, or no link of the robot has any geometry.
        """
        geometries = self.link(link).geometries
        if not any(item.geometries for item in self._links):
            raise ValueError(
                f"robot {self.name!r} has no geometry: no link of its URDF has a <collision> or <visual>"
            )
        if link not in self._meshes:
            import trimesh

            warn_of_sizes(self.name, link, geometries, arm_length(self.joints))
            meshes = [geometry.mesh() for geometry in geometries]
            merged: Any = trimesh.util.concatenate(meshes) if meshes else None
            self._meshes[link] = merged
        return self._meshes[link]

    @cached_property
    def neutral(self) -> Array:
        """A configuration (nv,) inside the limits: the middle of each interval, 0 without limits."""
        lower, upper = finite_interval(self.limits)
        return 0.5 * (lower + upper)

    def random_configuration(self, rng: np.random.Generator) -> Array:
        """A configuration (nv,), uniform within the limits; within ±pi where a coordinate has none."""
        return rng.uniform(*finite_interval(self.limits))

    def random_configurations(self, count: int, *, seed: int = 0) -> Array:
        """Configurations (count, nv) as `random_configuration` gives.

        The values of a coordinate depend on the seed, its name and its limits alone: they stay when another joint is
        added or dropped.
        """
        return random_configurations(self, count, seed)

    def check_configuration(self, q: ArrayLike, name: str = "q") -> Array:
        """`q` as an array (nv,) after checking its shape, that it is finite, and the position limits.

        What is outside by a rounding error, at most `JointLimits.rounding`, is taken as it is: encoders and published
        problems have it, and a controller moves inside.

        Raises:
            ValueError: names `name`, the joint, its value and the interval allowed.
        """
        return checked(self, q, name)

    def mass_matrix(self, q: ArrayLike) -> Array:
        """Joint-space inertia M(q) (nv, nv) [kg m^2, kg m, kg]; without rotor inertias."""
        return self._dynamics.mass_matrix(finite_vector(self, q, "q"))

    def bias(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Coriolis, centrifugal and gravity force (nv,) [Nm | N], gravity 9.81 m/s^2 along the world's -z.

        h(q, v) = C(q, v) v + g(q), so that M(q) a + h(q, v) = torque; no friction.
        """
        return self._dynamics.bias(finite_vector(self, q, "q"), finite_vector(self, v, "v"))

    @cached_property
    def inertials(self) -> tuple[_core.Inertial, ...]:
        """Mass properties of what moves with each joint, one per joint of `joints`, in the frame of its child.

        Links without inertia count nothing.

        Raises:
            ValueError: a link's rotational inertia is not positive semidefinite; names the link.
        """
        nothing = _core.Inertial(0.0, np.zeros(3), np.zeros((3, 3)))
        found = (link.inertial for link in self._links)
        links = [nothing if i is None else _core.Inertial(i.mass, i.com, i.inertia) for i in found]
        return tuple(_core.fold_inertials(self, links))

    @cached_property
    def pinocchio(self) -> pin.Model:
        """The same tree for Pinocchio (package `pin`), with a coordinate per moving joint, also of mimic joints."""
        from sidestep.robot.pinocchio_model import pinocchio_model

        return pinocchio_model(self, self._links)

    @cached_property
    def fingerprint(self) -> str:
        """Hash (64 hex digits) of kinematics and geometry, mesh files by content.

        Limits, inertias, file names and the base pose, on which a fitted body does not depend, do not enter.
        """
        return fingerprint_of(self, self._links)

    @cached_property
    def _dynamics(self) -> _core.RigidBodyDynamics:
        return _core.RigidBodyDynamics(self, self.inertials)
