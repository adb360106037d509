"""How finely the controller sees solids: light enough for the command line's defaults.

A thin finger sinks between the points by no more than the margin that commands keep.
"""

SPACING = 0.01  # [m] no point of a surface is farther than this from one that the controller sees
POINT_RADIUS = 0.005  # [m] of those
