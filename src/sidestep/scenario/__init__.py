"""Scenarios: one run of one arm as a YAML file with a published schema, and the runner."""

from sidestep.scenario.scenario import Scenario, shipped_scenarios
from sidestep.scenario.validation import ScenarioError, schema_text

__all__ = ["Scenario", "ScenarioError", "schema_text", "shipped_scenarios"]
