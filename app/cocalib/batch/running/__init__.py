"""What one job does, in whatever process an engine chooses: solve, evaluate, report and export a session."""

from cocalib.batch.running.running_job import run_job

__all__ = ["run_job"]
