"""The loop of the core and what it gives."""

from sidestep._core import (
    CycleObserver,
    Loop,
    LoopSettings,
    ModelLoop,
    RunEnd,
    RunReport,
    SupervisorSettings,
    clock_lateness,
    loop_settings_fields,
    supervisor_settings_fields,
)

__all__ = [
    "CycleObserver",
    "Loop",
    "LoopSettings",
    "ModelLoop",
    "RunEnd",
    "RunReport",
    "SupervisorSettings",
    "clock_lateness",
    "loop_settings_fields",
    "supervisor_settings_fields",
]
