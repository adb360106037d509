"""The report of a run: figures, log, animation and a web page."""

from sidestep.report.report import write_report

__all__ = ["write_report"]
