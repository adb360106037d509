"""Records runs of the controller as web pages that need no server: python docs/record_runs.py FOLDER [SCENE ...]

Each page plays one scene of the studio's gallery: the arm goes to and fro between start and goal while a ball moves
through its way. FOLDER/index.html lists them. Runs are synchronous, so they repeat. A scene takes a minute or two.
"""

from __future__ import annotations

import argparse
import html
from pathlib import Path

import numpy as np

from sidestep.math.pose import pose_at
from sidestep.robot import tip_of
from sidestep.scenario.assembly import coordinates, load_robot
from sidestep.studio import messages as m
from sidestep.studio.gallery import GALLERY, MOUSE_BALL, ends_of
from sidestep.studio.guard import Guard
from sidestep.studio.page import colours
from sidestep.studio.page.arm import ArmView, link_meshes, reach
from sidestep.studio.page.camera import Viewpoint, clear_view, extent
from sidestep.studio.page.cameras import NEAR
from sidestep.studio.page.marks import Marks
from sidestep.studio.page.obstacles import ObstacleViews
from sidestep.studio.page.scene import point_cameras, set_up_scene
from sidestep.studio.page.why import Why
from sidestep.studio.server import HOST, guarded_server
from sidestep.studio.session import Session
from sidestep.studio.systems import make_body

FRAME = 1.0 / 25.0  # [s] between two pictures
TRIANGLES = 15_000  # of an arm: half a megabyte
BALL_MIDDLE, BALL_SWING = np.array([0.45, 0.0, 0.62]), np.array([0.0, 0.45, 0.06])  # [m] of the ball's way
BALL_PERIOD = 8.0  # [s] to and fro

STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "iframe{width:100%;aspect-ratio:16/9;border:1px solid #ddd;border-radius:6px}h2{margin:2rem 0 .3rem}"
)


def record(label: str, seconds: float) -> tuple[str, str]:
    """A scene of the gallery as a page, and what it shows in a sentence.

    Raises RuntimeError where the arm touches something.
    """
    scenario = GALLERY[label].load()
    robot = load_robot(scenario)
    goals = ends_of(scenario, robot)
    session = Session(scenario, prepare=make_body, goals=goals, synchronous=True)
    server = guarded_server(HOST, 0, Guard(HOST))
    try:
        set_up_scene(server)
        meshes, tip = link_meshes(robot, TRIANGLES), tip_of(robot)
        arm = ArmView(server, robot, meshes, "/arm")
        ghost = ArmView(server, robot, meshes, "/goal", ghost=colours.GOAL)
        marks, why = Marks(server, robot, tip), Why(server, robot, tip)
        obstacles = ObstacleViews(server, lambda _: None, lambda _: None)
        obstacles.set_things(session.snapshot().things)
        ends = [coordinates(scenario.start, robot, "start"), *goals]
        frames = np.array([robot.pose(q, frame.name)[:3, 3] for q in ends for frame in robot.frames])
        solids = [thing.triangles for thing in session.snapshot().things]
        places = extent(robot, meshes, ends, solids, NEAR * reach(robot))
        point_cameras(server, Viewpoint.of(places, clear_view(frames, solids)))
        serializer = server.get_scene_serializer()
        moves = MOUSE_BALL in {item.name for item in scenario.obstacles}
        for _ in range(round(seconds / FRAME)):
            if moves:
                phase = 2.0 * np.pi * session.time / BALL_PERIOD
                swing = BALL_SWING * [0.0, np.cos(phase), np.sin(2.0 * phase)]
                session.handle(m.DragObstacle(MOUSE_BALL, pose_at(BALL_MIDDLE + swing)))
            for _ in range(round(FRAME / session.period)):
                session.step()
            now = session.snapshot()
            with server.atomic():
                arm.show(now.q)
                arm.colour({}, lit=now.reason.link)
                if now.posture is not None:
                    ghost.show(now.posture.q)
                ghost.hide_where_at(now.q)
                obstacles.show(now.things, now.poses)
                marks.show_trail(now.q, now.time, visible=True)
                why.show(now.q, now.reason, visible=True)
            serializer.insert_sleep(FRAME)
        if now.touched:
            raise RuntimeError(f"{label}: the arm touched {', '.join(now.contacts) or 'something'}")
        return str(serializer.as_html()), scenario.description or label
    finally:
        session.stop()
        server.stop()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="gets index.html and a page for each scene")
    usual = [
        label for label, scene in GALLERY.items() if scene.to_and_fro and isinstance(scene.scenario, str)
    ]
    parser.add_argument(
        "scenes", nargs="*", default=usual, help=f"of {', '.join(GALLERY)} [{', '.join(usual)}]"
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="of simulated time")
    options = parser.parse_args()
    unknown = [label for label in options.scenes if label not in GALLERY]
    if unknown:
        parser.error(f"no scene is called {unknown[0]!r}; known: {', '.join(GALLERY)}")
    options.folder.mkdir(parents=True, exist_ok=True)
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Recorded runs</title><style>{STYLE}</style>"
    ]
    parts.append(
        "<h1>Recorded runs</h1><p>The default controller, step by step as it ran. Drag to look around.</p>"
    )
    for label in options.scenes:
        page, sentence = record(label, options.seconds)
        name = f"{label.lower().replace(' ', '-')}.html"
        (options.folder / name).write_text(page, encoding="utf-8")
        print(f"{name}: {len(page) / 2**20:.1f} MiB", flush=True)
        parts.append(
            f"<h2>{html.escape(label)}</h2><p>{html.escape(sentence)}</p><iframe loading='lazy' src='{name}'>"
        )
        parts.append(f"</iframe><p><a href='{name}'>On a page of its own</a></p>")
    (options.folder / "index.html").write_text("\n".join([*parts, "</html>"]), encoding="utf-8")


if __name__ == "__main__":
    main()
