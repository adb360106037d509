"""How finely the controller sees solids: light enough for the command line's defaults."""

SPACING = 0.02  # [m] no point of a surface is farther than this from one that the controller sees
POINT_RADIUS = (
    0.005  # [m] of those: SPACING^2 / (2 * 4 cm), so that a surface curved by 4 cm does not sink between them
)
