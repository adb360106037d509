from .arm import Arm as Arm
from .preparation import Progress as Progress
from .preparation import prepare as prepare
