"""What every driver gives, and the ideal robot of the core."""

from sidestep._core import IdealDriver as Ideal
from sidestep._core import NativeDriver, RobotDescription, RobotState, RobotStopped, SimulatorDriver

__all__ = ["Ideal", "NativeDriver", "RobotDescription", "RobotState", "RobotStopped", "SimulatorDriver"]
