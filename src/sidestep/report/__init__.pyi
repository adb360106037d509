from .recorded_arrays import RecordedArrays as RecordedArrays
from .recorded_events import RecordedEvent as RecordedEvent
from .recorded_run import RecordedRun as RecordedRun
from .recorded_run import load_recording as load_recording
from .report import write_report as write_report
