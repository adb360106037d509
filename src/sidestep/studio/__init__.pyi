from .start import starting_scenario as starting_scenario
from .studio import Studio as Studio
