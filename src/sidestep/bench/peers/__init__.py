"""What other software takes for the work of one control step, on one core, in one run."""
