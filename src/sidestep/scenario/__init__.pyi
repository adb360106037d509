from .result import ScenarioResult as ScenarioResult
from .runner import run_scenario as run_scenario
from .scenario import Scenario as Scenario
from .scenario import shipped_scenarios as shipped_scenarios
from .validation import ScenarioError as ScenarioError
from .validation import schema_text as schema_text
