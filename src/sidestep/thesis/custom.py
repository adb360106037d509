"""What moves the arm of a scenario of method `custom`: its density, embedding and switch. See `CustomMethod`."""

from __future__ import annotations

from typing import TypeAlias

from sidestep._core import (
    BinarySwitch,
    CollisionDensity,
    DistanceSwitch,
    Embedding,
    GeodesicOnly,
    GeometricSystem,
    HarmonicOnly,
    JointLimitPotential,
    SigmoidSwitch,
    Sum,
    Unswitched,
)
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.scenario.scenario import EmbeddingConfig, SwitchConfig, SystemConfig
from sidestep.thesis.adapter import SystemAdapter as SystemAdapter

Switch: TypeAlias = Unswitched | HarmonicOnly | GeodesicOnly | BinarySwitch | SigmoidSwitch | DistanceSwitch


def system_of(embedding: EmbeddingConfig, system: SystemConfig, robot: Robot, body: Body) -> GeometricSystem:
    """The system that a file writes out; raises ValueError where its switch does not fit the robot."""
    return GeometricSystem(
        _embeddings(embedding, robot, body),
        stiffness=system.stiffness,
        damping=system.damping,
        damping_form=system.damping_form,
        switch=_switch(system.switch, robot),
    )


def _embeddings(choice: EmbeddingConfig, robot: Robot, body: Body) -> list[Embedding]:
    parts: list[Embedding] = [CollisionDensity(robot, body, average=choice.density == "average")]
    if choice.joint_limits is not None:
        parts.append(
            JointLimitPotential(robot, slope=choice.joint_limits.slope, height=choice.joint_limits.height)
        )
    return [Sum(parts)] if choice.combine == "sum" and len(parts) > 1 else parts


def _switch(choice: SwitchConfig, robot: Robot) -> Switch:
    match choice:
        case SwitchConfig(type="none"):
            return Unswitched()
        case SwitchConfig(type="harmonic_only"):
            return HarmonicOnly()
        case SwitchConfig(type="geodesic_only"):
            return GeodesicOnly()
        case SwitchConfig(type="binary", threshold=float(threshold)):
            return BinarySwitch(threshold=threshold)
        case SwitchConfig(type="sigmoid", threshold=float(threshold), slope=float(slope)):
            return SigmoidSwitch(threshold=threshold, slope=slope)
        case SwitchConfig(type="distance", thresholds=tuple(thresholds), slope=float(slope)):
            if len(thresholds) != robot.num_coordinates:
                raise ValueError(
                    f"switch.thresholds has {len(thresholds)} values; robot {robot.name!r} has "
                    f"{robot.num_coordinates} coordinates ({', '.join(robot.coordinate_names)})"
                )
            return DistanceSwitch(thresholds=thresholds, slope=slope)
    raise ValueError(f"switch of type {choice.type!r} lacks a number it needs, got {choice}")
