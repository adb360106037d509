from .arm import Arm as Arm
from .attachment import attachment as attachment
from .preparation import Progress as Progress
from .preparation import prepare as prepare
from .refinement import Refinement as Refinement
