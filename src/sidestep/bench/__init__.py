"""Random reach problems: how often an arm arrives, touches, or is stuck, and what a step costs."""

from sidestep.bench.methods import Method, build_system
from sidestep.bench.motion import Motion, MotionSettings, move
from sidestep.bench.outcome import Judge, Outcome
from sidestep.bench.problem_file import read_problems, write_problems
from sidestep.bench.problems import ProblemGenerator, ProblemSettings, ReachProblem, Workspace
from sidestep.bench.reach import BenchResult, BenchSettings, default_jobs, run_bench

__all__ = [
    "BenchResult",
    "BenchSettings",
    "Judge",
    "Method",
    "Motion",
    "MotionSettings",
    "Outcome",
    "ProblemGenerator",
    "ProblemSettings",
    "ReachProblem",
    "Workspace",
    "build_system",
    "default_jobs",
    "move",
    "read_problems",
    "run_bench",
    "write_problems",
]
