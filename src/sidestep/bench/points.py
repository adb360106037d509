"""How finely the controller sees solids: light enough for the command line's defaults."""

SPACING = 0.01  # [m] no point of a surface is farther than this from one that the controller sees
POINT_RADIUS = (
    0.005  # [m] of those; a thin finger sinks between them by the margin that commands keep, at most
)
