"""The controller and the simulated robot as two programs, over a connection that is late and loses messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep._core import RunEnd
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.parallel import Progress
from sidestep.bench.problems import ProblemGenerator, ProblemSettings, ReachProblem
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.robot.turns import ways_to
from sidestep.scenario.assembly import Assembly, assemble
from sidestep.scenario.config import ELSEWHERE, FIELDS, with_values
from sidestep.scenario.scenario import JointState, Obstacle, RobotConfig, Scenario
from sidestep.scenario.two_programs import ARRIVAL, run_in_two_programs
from sidestep.shapes import Sphere
from sidestep.simulation import Simulation
from sidestep.simulation.limit_watch import COUNTED, LimitWatch
from sidestep.simulation.link import Link

Array = npt.NDArray[np.float64]

THESIS = ("thesis-6.2.2", "thesis-6.2.3", "thesis-6.2.4")
TOLERANCE = 1e-3  # [m] of minimum clearances, as of reach problems
OF_SIMULATOR = (  # of its report
    "contacts",
    "contact_pairs",
    "limits",
    "torque_leaps",
    "lost_cycles",
    "longest_silence_cycles",
    "messages",
    "trouble",
)


@dataclass(frozen=True)
class TwoProgramsSettings:
    """What is run, over which connection.

    Attributes:
        link: how late and lossy it is; its seed is that of the first run.
        scenarios: names of shipped ones.
        problems: number of reach problems. robot: of them. obstacles: balls in each. seed: of all.
        duration: longest time of a run [s].
        speed: of the simulator: 0 as fast as it is asked, which repeats; 1 by the machine's clock.
        leap: torques leap as they are told, see `MuJoCo`.
        controller: settings beside the defaults, as those of a scenario.

    Raises:
        ValueError: a value out of range.
    """

    link: Link = field(default_factory=Link)
    scenarios: tuple[str, ...] = THESIS
    problems: int = 50
    robot: str = "fr3"
    obstacles: int = 10
    seed: int = 0
    duration: float = 30.0
    speed: float = 0.0
    leap: bool = False
    controller: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        if self.problems < 0:
            raise ValueError(f"problems is {self.problems}; allowed: 0 or more")
        if not (np.isfinite(self.duration) and self.duration > 0.0):
            raise ValueError(f"duration is {self.duration} s; allowed: positive and finite")
        for name, _ in self.controller:
            if name not in FIELDS or name in ELSEWHERE:
                allowed = ", ".join(known for known in FIELDS if known not in ELSEWHERE)
                raise ValueError(f"controller has {name!r}; allowed: {allowed}")


@dataclass(frozen=True)
class _Task:
    """A thesis scenario by its name, or a reach problem by its index; in two programs, or in one process."""

    scenario: str
    index: int
    apart: bool

    @property
    def name(self) -> str:
        return f"{self.scenario} {'two programs' if self.apart else 'one process'}"


def run_two_programs(
    settings: TwoProgramsSettings,
    *,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """A row for every run, see `run_campaign`."""
    runs = [(name, index) for index, name in enumerate(settings.scenarios)]
    runs += [(f"reach-{index}", index) for index in range(settings.problems)]
    tasks = [_Task(name, index, apart) for name, index in runs for apart in (True, False)]
    return run_campaign(
        partial(_Worker, settings),
        tasks,
        name=lambda task: task.name,
        settings={"bench": "two-programs", **asdict(settings)},
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


def two_programs_table(rows: Sequence[Row]) -> dict[str, Row]:
    """Runs, arrivals, contacts and limits of scenarios and of reach problems, in two programs and in one process."""
    table: dict[str, Row] = {}
    for kind in ("scenarios", "reach"):
        for where in ("two programs", "one process"):
            mine = [
                row
                for row in rows
                if row["name"].endswith(where) and row["name"].startswith("reach-") == (kind == "reach")
            ]
            if mine:
                table[f"{kind}, {where}"] = _sum_of(mine)
    return table


def is_clean(row: Row) -> bool:
    """Whether nothing was touched and no limit that a command must keep was exceeded."""
    exceeded = any(row["limits"][name]["cycles"] for name in COUNTED)
    return not (row["contacts"] or row["touched"] or row["touched_itself"] or exceeded)


def _sum_of(rows: Sequence[Row]) -> Row:
    clearances = [row["min_clearance_m"] for row in rows if row["min_clearance_m"] is not None]
    limits = {
        name: {
            "runs": sum(row["limits"][name]["cycles"] > 0 for row in rows),
            "cycles": sum(row["limits"][name]["cycles"] for row in rows),
            "worst": max(row["limits"][name]["worst"] for row in rows),
            "largest": max(row["limits"][name]["largest"] for row in rows),
        }
        for name in rows[0]["limits"]
    }
    times = [row["time_s"] for row in rows if row["arrived"] and row["time_s"] is not None]
    return {
        "runs": len(rows),
        "arrived": sum(row["arrived"] for row in rows),
        "contacts": sum(row["contacts"] for row in rows),
        "touched": sum(row["touched"] or row["touched_itself"] for row in rows),
        "min_clearance_m": min(clearances, default=None),
        "median_time_s": float(np.median(times)) if times else None,
        "largest_error_rad": max((row["error_rad"] for row in rows if row["arrived"]), default=None),
        "torque_leaps": sum(row.get("torque_leaps", {}).get("cycles", 0) for row in rows),
        "limits": limits,
    }


class _Worker:
    """Runs tasks in one process, each with a simulator of its own."""

    def __init__(self, settings: TwoProgramsSettings) -> None:
        self.settings = settings
        problems = ProblemSettings(robot=settings.robot, obstacles=settings.obstacles, seed=settings.seed)
        self._generator = ProblemGenerator(problems)

    def run(self, task: _Task) -> Row:
        scenario = self._scenario(task)
        parts = assemble(scenario)
        row: Row = {"name": task.name, "scenario": scenario.name}
        if task.apart:
            return row | self._in_two_programs(scenario, parts, task.index)
        return row | self._in_one_process(scenario, parts)

    def _scenario(self, task: _Task) -> Scenario:
        if task.scenario in self.settings.scenarios:
            scenario = Scenario.load(task.scenario)
        else:
            scenario = reach_scenario(self._generator.problem(task.index))
        return replace(
            scenario,
            method="controller",
            controller=with_values({}, dict(self.settings.controller)),
            simulation=replace(scenario.simulation, mode="torque", duration=self.settings.duration),
        )

    def _in_two_programs(self, scenario: Scenario, parts: Assembly, index: int) -> Row:
        link = replace(self.settings.link, seed=self.settings.link.seed + index)
        ran = run_in_two_programs(
            scenario,
            parts,
            link=link,
            speed=self.settings.speed,
            leap=self.settings.leap,
            start_in_contact=True,  # of the covers: one process begins there too
        )
        found = ran.found
        return {
            "arrived": ran.report.end == RunEnd.arrived,
            "end": ran.report.end.name,
            "why": ran.report.why,
            "worst_status": ran.report.worst.name,
            "time_s": ran.time_to_goal,
            "delay_s": ran.delay,
            **{name: found[name] for name in OF_SIMULATOR},
            **_judge(parts, ran.q, ran.object_poses),
        }

    def _in_one_process(self, scenario: Scenario, parts: Assembly) -> Row:
        simulation = Simulation(
            parts.robot, parts.objects, timestep=scenario.simulation.period, visuals=False
        )
        motion = simulation.run(
            parts.driver,
            parts.start,
            parts.goal,
            self.settings.duration,
            start_velocity=parts.start_velocity,
            arrival=ARRIVAL,
        )
        watch = LimitWatch(parts.robot.limits, motion.timestep)
        for row in zip(motion.q, motion.v, motion.torque, motion.achieved, strict=True):
            watch.observe(*row)
        return {
            "arrived": motion.arrived,
            "time_s": motion.time_to_goal,
            "contacts": len(motion.contacts),
            "limits": watch.to_dict(),
            **_judge(parts, motion.q, motion.object_poses),
        }


def _judge(parts: Assembly, q: Array, poses: Array) -> Row:
    """What a motion q (T, nv) among objects (T, N, 7) touched, on exact meshes between samples, and where it ended."""
    clearance, pair = None, ""
    if parts.objects:
        worst = ExactClearance(parts.robot, parts.objects).decided_minimum(q, poses, tolerance=TOLERANCE)
        distance = worst.clearance.distance
        clearance = distance if worst.lower_bound > 0.0 else min(distance, worst.lower_bound)
        pair = f"{worst.clearance.link} - {worst.clearance.obstacle}"
    own = SelfCollision(parts.robot).minimum_over(q, tolerance=TOLERANCE)
    return {
        "min_clearance_m": clearance,
        "clearance_pair": pair,
        "touched": clearance is not None and clearance <= 0.0,
        "touched_itself": bool(own.pair and own.distance <= 0.0),
        "error_rad": float(ways_to(parts.robot, q[-1], parts.goal).max()),
    }


def reach_scenario(problem: ReachProblem) -> Scenario:
    """A reach problem as a scenario."""
    balls = tuple(
        Obstacle(
            shape=Sphere(float(radius)),
            position=(float(x), float(y), float(z)),
            name=f"ball{k}",
            points="ball",
        )
        for k, ((x, y, z), radius) in enumerate(zip(problem.centers, problem.radii, strict=True))
    )
    return Scenario(
        name=f"reach-{problem.index}",
        robot=RobotConfig(name=problem.robot),
        start=JointState("rad", tuple(map(float, problem.start))),
        goal=JointState("rad", tuple(map(float, problem.goal))),
        obstacles=balls,
    )
