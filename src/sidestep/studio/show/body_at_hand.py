"""The covering ellipsoids of a robot, where they are made already."""

from __future__ import annotations

from sidestep.body import Body
from sidestep.body.cache import cache_path
from sidestep.body.cover_settings import CoverSettings
from sidestep.shipped_arms import with_body_of
from sidestep.studio.show.reading import Reading


def body_at_hand(reading: Reading) -> Body | None:
    """The body of the arm file, of an arm that comes with Sidestep, or of the user's cache; None without any."""
    if reading.arm is not None:
        return Body.of_arm(reading.arm)
    robot = reading.robot
    if not any(link.geometries for link in robot.links):
        return None
    if with_body_of(robot) is not None or cache_path(robot, CoverSettings()).is_file():
        return Body.cover(robot)
    return None
