"""Times one action of `fabrics`. Run as a script by an interpreter that has it: it pins an old NumPy and pytest.

Reads a scene as JSON from stdin and writes the microseconds of calls to stdout.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np
from fabrics.planner.parameterized_planner import ParameterizedFabricPlanner
from forwardkinematics.urdfFks.generic_urdf_fk import GenericURDFFk
from mpscenes.goals.goal_composition import GoalComposition


def main() -> None:
    scene = json.load(sys.stdin)
    links, dof = scene["links"], len(scene["goal"])
    root, tip = scene["root"], links[-1]
    planner = ParameterizedFabricPlanner(dof, GenericURDFFk(scene["urdf"], root_link=root, end_links=[tip]))
    goal = GoalComposition(
        name="goal",
        content_dict={
            "reach": {
                "weight": 1.0,
                "is_primary_goal": True,
                "indices": [0, 1, 2],
                "parent_link": root,
                "child_link": tip,
                "desired_position": scene["goal_position"],
                "epsilon": 0.05,
                "type": "staticSubGoal",
            }
        },
    )
    balls = scene["balls"]
    planner.set_components(
        collision_links=links,
        goal=goal,
        number_obstacles=len(balls),
        limits=list(zip(*scene["limits"], strict=True)),
    )
    planner.concretize()
    still = {
        "weight_goal_0": 1.0,
        "x_goal_0": np.array(scene["goal_position"]),
        **{f"x_obst_{k}": np.array(ball[:3]) for k, ball in enumerate(balls)},
        **{f"radius_obst_{k}": np.array([ball[3]]) for k, ball in enumerate(balls)},
        # Links whose origin no joint moves have no sphere.
        **{
            f"radius_body_{link}": np.array([scene["radii"][link]])
            for link in links
            if link in scene["moved"]
        },
    }
    states = [(np.array(q), np.array(v)) for q, v in zip(scene["q"], scene["v"], strict=True)]

    def act(k: int) -> Any:
        q, v = states[k % len(states)]
        return planner.compute_action(q=q, qdot=v, **still)

    if not np.isfinite(act(0)).all():
        raise SystemExit("the action is not finite")
    times: list[float] = []
    end = time.perf_counter() + scene["seconds"]
    while time.perf_counter() < end:
        start = time.perf_counter_ns()
        act(len(times))
        times.append(1e-3 * (time.perf_counter_ns() - start))
    json.dump(times, sys.stdout)


if __name__ == "__main__":
    main()
