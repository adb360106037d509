"""How arms, bodies and obstacles look in every picture: one palette, one lamp, one painter (Matplotlib)."""

from sidestep.drawing.arm import Solid, draw_arm
from sidestep.drawing.views import ArmViews

__all__ = ["ArmViews", "Solid", "draw_arm"]
