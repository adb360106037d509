"""Reading, checking and writing scenario files."""

import dataclasses
import json
from operator import attrgetter
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml

import sidestep as ss
from sidestep.control import SafetySettings
from sidestep.controller import SpeedLimitSettings, controller_settings_fields
from sidestep.scenario import Scenario, ScenarioError, schema_text, shipped_scenarios
from sidestep.scenario import scenario as module
from sidestep.scenario.config import OPTIONAL
from sidestep.scenario.controller_settings import controller_settings_of
from sidestep.scenario.torque_program import program_from, torque_qp_of
from sidestep.scenario.validation import check_document
from sidestep.shapes import Sphere

BASE = """\
format: 1
name: small
robot: {name: planar2}
start: {unit: deg, position: [0, 10]}
goal: {unit: rad, position: [0.5, 0.25]}
body: {components: 3, covariance: diagonal, seed: 7}
obstacles:
  - name: ball
    shape: {type: sphere, radius: 0.05}
    position: [0.9, 0.1, 0.0]
    motion: {to: [0.9, 0.2, 0.0], begin: 1.0, end: 2.0}
    points: surface
system: {stiffness: 2, switch: {type: distance, thresholds: [0.1, 0.2], slope: 30}}
simulation: {mode: kinematic, period: 0.002}
"""


GOAL = "goal: {unit: rad, position: [0.5, 0.25]}"
POSE = "goal: {frame: tip, position: [1, 0.5, 0], rotation_deg: [0, 0, 45]}"


def parse(text: str) -> Scenario:
    return Scenario.from_text(text, file="file.yaml")


def test_every_value_of_a_file_arrives() -> None:
    scenario = parse(BASE)
    assert scenario.name == "small"
    assert scenario.robot.name == "planar2"
    assert (scenario.start.unit, scenario.start.position, scenario.start.velocity) == (
        "deg",
        (0.0, 10.0),
        None,
    )
    assert (scenario.goal.unit, scenario.goal.position) == ("rad", (0.5, 0.25))
    assert scenario.body == module.BodyConfig(components=3, covariance="diagonal", seed=7)
    (ball,) = scenario.obstacles
    assert ball.shape == Sphere(0.05)
    assert ball.motion == module.StraightMove(to=(0.9, 0.2, 0.0), begin=1.0, end=2.0)
    assert (ball.points, ball.free, ball.spacing) == ("surface", False, 0.03)
    assert scenario.system.stiffness == 2.0
    assert scenario.system.damping == 1.5
    assert scenario.system.switch == module.SwitchConfig("distance", thresholds=(0.1, 0.2), slope=30.0)
    assert scenario.simulation == module.SimulationConfig(mode="kinematic", period=0.002)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format: 1", "format: 2", "format is 2; allowed: 1"),
        ("goal:", "gaol:", "the key 'goal' is missing"),
        (
            "name: small",
            "name: small\ncolour: red",
            "unknown key 'colour' (value 'red'); allowed: format, name",
        ),
        ("name: small", "name: small\n1: red", "unknown key 1 (value 'red'); allowed: format, name"),
        ("name: small", "name: 2024-05-01", "name is datetime.date(2024, 5, 1); it must be of type string"),
        ("name: small", "name: a b", "name is 'a b'; it must match"),
        ("{name: planar2}", "{}", "robot is {}; it needs either 'name' or 'urdf'"),
        ("{name: planar2}", "{name: a, urdf: b}", "it needs either 'name' or 'urdf'"),
        ("unit: deg", "unit: grad", "start.unit is 'grad'; allowed: deg, rad"),
        ("unit: deg, ", "", "start: the key 'unit' is missing"),
        ("radius: 0.05", "radius: -1", "obstacles[0].shape.radius is -1; it must be greater than 0"),
        ("radius: 0.05", "radius: .nan", "obstacles[0].shape.radius is nan; it must be a finite number"),
        ("radius: 0.05", "radius: 5e-2", "is '5e-2'; it must be of type number (YAML reads it as text"),
        ("radius: 0.05", "radius: 1, size: 2", "unknown key 'size' (value 2); allowed: type, radius"),
        (
            "type: sphere",
            "type: ball",
            "shape.type is 'ball'; allowed: sphere, box, cylinder, capsule, plane, mesh, points",
        ),
        ("[0.9, 0.1, 0.0]", "[0.9, 0.1]", "position is [0.9, 0.1] with 2 values; it must have at least 3"),
        ("components: 3", "components: cic", "allowed: an integer from 1, one per link name, 'aic', 'bic'"),
        ("components: 3", "components: 0", "body.components is 0; it must be at least 1"),
        ("slope: 30", "slope: 0", "system.switch.slope is 0; it must be greater than 0"),
        (", slope: 30", "", "system.switch: the key 'slope' is missing"),
        ("mode: kinematic", "mode: fast", "simulation.mode is 'fast'; allowed: torque, kinematic"),
        ("period: 0.002", "period: 1", "simulation.period is 1; it must be at most 0.1"),
        ("end: 2.0", "end: 0.5", "obstacles[0].motion: end is 0.5; it must be after begin (1.0)"),
        ("points: surface", "free: true", "obstacles[0].free is true; a free obstacle starts at rest"),
        ("points: surface", "velocity: [1, 0, 0]", "give either velocity or motion, not both"),
        ("seed: 7", "seed: 7, seed: 8", "line 6, column 54: not valid YAML: the key 'seed' is given twice"),
        ("robot: {", "robot: {{", "not valid YAML"),
        (GOAL, "goal: {frame: tip, position: [1, 0, 0]}", "goal: the key 'rotation_deg' is missing"),
        (GOAL, POSE.replace("frame", "link"), "allowed: unit, position, or of a pose frame, position"),
        (
            GOAL,
            POSE.replace("45]", "45], unit: rad"),
            "unknown key 'unit' (value 'rad'); allowed: frame, pos",
        ),
        (GOAL, POSE.replace("[1, 0.5, 0]", "[1, 0.5]"), "goal.position is [1, 0.5] with 2 values; it must"),
        (
            "body:",
            "controller: {barriers: {flor: 1}}\nbody:",
            "unknown key 'flor' (value 1); allowed: stiffness",
        ),
        (
            "body:",
            "controller: {barriers: {power: 1}}\nbody:",
            "controller.barriers.power is 1; it must be at l",
        ),
        (
            "body:",
            "controller: {barriers: null}\nbody:",
            "controller.barriers is None; it must be of type obj",
        ),
        (
            "body:",
            "controller: {period: 0.01}\nbody:",
            "unknown key 'period' (value 0.01); allowed: speed, limit_m",
        ),
        ("body:", "controller: {local_activation: 1}\nbody:", "is 1; it must be of type boolean"),
        ("body: {", "body: {ellipsoids: 0, ", "body.ellipsoids is 0; it must be at least 1"),
        (
            "body:",
            "barriers: {floor: 0.01, ellipsoids: 2}\nbody:",
            "has keys of release 0.1.0; write barriers as controller.barriers, barriers.ellipsoids as body.ell",
        ),
        ("body:", "escape: {leg: 3}\nbody:", "write escape as controller.local_minimum"),
        ("body:", "evasion: {}\nbody:", "write evasion as controller.look_ahead"),
        (
            "body:",
            "guide: {route: {speed: 1}}\nbody:",
            "guide as controller.planner, guide.route as controller.planner.route",
        ),
        ("body:", "torque: {safety: {}}\nbody:", "torque as controller, torque.safety as controller.safety"),
        ("body:", "method: guided\nbody:", "write method: guided as method: controller"),
        ("body:", "method: written\nbody:", "write method: written as method: custom"),
        ("body:", "method: magic\nbody:", "allowed: custom, controller, barrier, reactive"),
        (BASE, "- 1", "a scenario is a mapping of keys to values, got list"),
        (BASE, "", "a scenario is a mapping of keys to values, got NoneType"),
    ],
)
def test_one_error_names_file_place_value_and_what_is_allowed(old: str, new: str, message: str) -> None:
    assert old in BASE
    with pytest.raises(ScenarioError) as caught:
        parse(BASE.replace(old, new, 1))
    assert str(caught.value).startswith("file.yaml")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


LAUGHS = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 20)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("? [1, 2]\n: x\n" + BASE, "line 1, column 3: not valid YAML: a key is [1, 2]; it must be text"),
        (BASE.replace("{name: planar2}", "{{name: a}: b}"), "a key is {'name': 'a'}; it must be text"),
        (BASE + "x: !!set {? [a]}\n", "a key is ['a']; it must be text"),
        (BASE + "x: &a [1, *a]\n", "the alias '*a' stands inside the value that it repeats"),
        ("&all\nname: *all\n", "the alias '*all' stands inside the value that it repeats"),
        (BASE + "x: " + "[" * 100 + "]" * 100, "nested more than 32 deep; at most 32 is allowed"),
        (BASE + "x: " + "[" * 100_000, "at most 32 is allowed"),
        (
            BASE + "x:\n" + "".join(" " * k + "a:\n" for k in range(1, 200)),
            "nested more than 32 deep; at most 32",
        ),
        (LAUGHS + BASE, "the alias '*a3' makes more than 50000 values; at most 50000 are allowed"),
        (LAUGHS.replace("[", "{<<: [").replace("]", "]}"), "more than 50000 values; at most 50000"),
        (BASE + "#" * 4_000_000, "characters; at most 4000000 are allowed"),
        (BASE.replace("small", "2024-13-45"), "'2024-13-45' is no timestamp: month must be in 1..12"),
        (BASE.replace("small", "!!bool maybe"), "'maybe' is no bool"),
        (BASE.replace("0.002", "1.0e-12"), "simulation.period is 1e-12 with a duration of 15.0 s, which"),
        (BASE.replace("0.002", "5.0e-324"), "at most 2000000 are allowed: a period from 7.5e-06 s"),
        (
            BASE + "controller: {look_ahead: {period: 0.0005, horizon: 30}}\n",
            "controller.look_ahead.period is 0.0005 with a horizon of 30.0 s, which takes 6e+04 steps; at most 1",
        ),
        (
            BASE + "controller: {look_ahead: {period: 1.0e-12}}\n",
            "controller.look_ahead.period is 1e-12; it must be at least 0.0005",
        ),
        (BASE + "controller: {look_ahead: {horizon: 1.0e+12}}\n", "it must be at most 30"),
        (
            BASE + "controller: {look_ahead: {tries: 100000000000}}\n",
            "look_ahead.tries is 100000000000; it must be at most 100000",
        ),
        (BASE.replace("components: 3", "components: 1000000000"), "it must be at most 200"),
        (
            BASE.replace("[0.9, 0.1, 0.0]", f"[1{'0' * 400}, 0, 0]"),
            f"obstacles[0].position[0] is 1{'0' * 99}…; at most 1e+30 in size is allowed",
        ),
        (BASE.replace("[0.9, 0.1, 0.0]", "[1.0e+300, 0, 0]"), "position[0] is 1e+300; at most 1e+30 in size"),
        (BASE.replace("[0.9, 0.1, 0.0]", f"[1{'0' * 5000}, 0, 0]"), f"'1{'0' * 98}… is no int"),
        (BASE + f"x: {'y' * 1_000_000}\n", f"unknown key 'x' (value '{'y' * 99}…); allowed: format, name"),
    ],
)
def test_files_that_would_never_be_built_are_refused_in_one_short_line(text: str, message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(text)
    assert str(caught.value).startswith("file.yaml")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_an_alias_may_repeat_what_is_complete() -> None:
    text = BASE.replace("start: {", "start: &here {").replace(GOAL, "goal: *here")
    assert parse(text).goal == parse(text).start


def test_an_integer_beyond_64_bits_is_read_as_it_is() -> None:
    seed = 2**64 + 1
    assert parse(BASE.replace("seed: 7", f"seed: {seed}")).body.seed == seed


def test_a_ball_of_points_is_refused_for_a_box() -> None:
    text = BASE.replace("{type: sphere, radius: 0.05}", "{type: box, size: [1, 1, 1]}")
    with pytest.raises(ScenarioError, match="points is 'ball'; a box allows centre, surface"):
        parse(text.replace("points: surface", "points: ball"))


def test_a_pose_and_the_numbers_of_barriers_arrive_and_survive_saving(tmp_path: Path) -> None:
    numbers = "controller: {barriers: {activation: 0.15, floor: 0.003, temperature: 0.001234567890123}}"
    posture = POSE.replace("45]", "45], posture: {unit: deg, position: [10, 20]}")
    scenario = parse(BASE.replace(GOAL, f"{posture}\nmethod: controller\n{numbers}"))
    assert scenario.goal == module.PoseConfig(
        "tip", (1.0, 0.5, 0.0), (0.0, 0.0, 45.0), module.JointState("deg", (10.0, 20.0))
    )
    assert scenario.method == "controller"
    barriers = {"activation": 0.15, "floor": 0.003, "temperature": 0.001234567890123}
    assert scenario.controller == {"barriers": barriers}
    scenario.save(tmp_path / "copy.yaml")
    assert Scenario.load(tmp_path / "copy.yaml") == scenario


@pytest.mark.parametrize("name", shipped_scenarios())
def test_shipped_scenarios_survive_saving_and_loading(name: str, tmp_path: Path) -> None:
    scenario = Scenario.load(name)
    assert scenario.name == name
    assert scenario.description
    scenario.save(tmp_path / "copy.yaml")
    assert Scenario.load(tmp_path / "copy.yaml") == scenario


def test_files_stay_reachable_from_where_a_scenario_is_saved(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b" / "c").mkdir(parents=True)
    text = BASE.replace("{name: planar2}", "{urdf: arm.urdf, package_dirs: [parts]}")
    text = text.replace("{type: sphere, radius: 0.05}", "{type: mesh, file: rock.stl}")
    (tmp_path / "a" / "s.yaml").write_text(text)
    Scenario.load(tmp_path / "a" / "s.yaml").save(tmp_path / "b" / "c" / "s.yaml")
    copy = Scenario.load(tmp_path / "b" / "c" / "s.yaml")
    assert copy.robot.urdf == "../../a/arm.urdf"
    assert copy.file(copy.robot.package_dirs[0]) == tmp_path / "a" / "parts"
    assert copy.file(str(copy.obstacles[0].shape.file)) == tmp_path / "a" / "rock.stl"


def test_an_unknown_scenario_lists_the_shipped_ones() -> None:
    with pytest.raises(
        FileNotFoundError, match=r"no scenario 'nothing'.*planar-one-obstacle.*thesis-6\.2\.4"
    ):
        Scenario.load("nothing")


def test_a_file_that_is_not_text_is_named(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScenarioError, match=r"s\.yaml: cannot be read as UTF-8"):
        Scenario.load(tmp_path / "s.yaml")


def test_thesis_scenarios_have_the_figures_of_the_thesis() -> None:
    free, cluster, diagonal = (Scenario.load(f"thesis-6.2.{n}") for n in (2, 3, 4))
    for scenario in (free, cluster, diagonal):
        assert (scenario.system.stiffness, scenario.system.damping) == (0.5, 1.5)
        assert scenario.system.switch.thresholds == (0.1, 0.1, 0.2, 0.2, 0.2, 0.2, 0.1)
    assert free.start.position == cluster.start.position == (0, 45, 0, -66, 0, 66, 45)
    assert free.goal.position == cluster.goal.position == (90, 45, 0, -66, 0, 66, 45)
    assert diagonal.start.position == (0, 80, 0, -30, 0, 66, 45)
    assert diagonal.goal.position == (100, 10, 0, -66, 0, 66, 45)
    assert free.obstacles == ()
    assert [o.position for o in cluster.obstacles] == [
        (0.4, 0.53, 0.52),
        (0.4, 0.51, 0.52),
        (0.3, 0.45, 0.52),
    ]
    assert [o.position for o in diagonal.obstacles] == [
        (0.3, 0.23, 0.42),
        (0.2, 0.51, 0.75),
        (0.2, 0.51, 0.55),
    ]


def test_the_schema_is_valid_and_states_the_defaults_of_the_classes() -> None:
    schema = json.loads(schema_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    parts = {
        "body": module.BodyConfig(),
        "embedding": module.EmbeddingConfig(),
        "system": module.SystemConfig(),
        "simulation": module.SimulationConfig(),
    }
    for key, value in parts.items():
        for field in dataclasses.fields(value):
            if field.name != "switch":
                stated = schema["properties"][key]["properties"][field.name]["default"]
                assert stated == getattr(value, field.name), f"{key}.{field.name}"
    assert schema["properties"]["system"]["properties"]["switch"]["default"] == {"type": "none"}
    defaults = {f.name: f.default for f in dataclasses.fields(module.Obstacle)}
    for name in ("free", "points", "spacing"):
        assert schema["$defs"]["obstacle"]["properties"][name]["default"] == defaults[name]


@pytest.mark.parametrize("field", controller_settings_fields(), ids=lambda field: field["name"])
def test_the_schema_states_the_settings_of_the_core(field: dict[str, Any]) -> None:
    part = json.loads(schema_text())["$defs"]["controller"]
    *parts, own = field["name"].split(".")
    if field["name"] in ("period", "synchronous"):  # of the simulation
        assert own not in part["properties"]
        return
    for name in parts:
        part = part["properties"][name]
        assert part["additionalProperties"] is False
    stated = part["properties"][own]
    assert field["trades"] in stated["description"]
    assert stated.get("default", np.inf) == field["default"]
    if not isinstance(field["default"], bool):
        assert stated["minimum"] == field["least"]
        assert stated.get("maximum", np.inf) == pytest.approx(field["most"])
    lowest: Any = (
        field["least"] if isinstance(field["default"], float) else type(field["default"])(field["least"])
    )
    for name in reversed(field["name"].split(".")):
        lowest = {name: lowest}
    check_document({**yaml.safe_load(BASE), "controller": lowest}, file="file.yaml")


def test_the_section_controller_is_the_settings_of_the_core(tmp_path: Path) -> None:
    text = (
        BASE
        + """
method: controller
controller:
  slack_weight: 50.5
  stop_time: 0.1
  local_activation: false
  look_ahead: {tries: 30, delay: 0.2}
  local_minimum: null
  planner: {patience: 2, search: {margin: 0.08, max_nodes: 500}, route: {lead: 0.3}}
  safety: {margin: 0.012345678901234, max_rows: 8}
  speed_limits: {near_speed: 0.125}
"""
    )
    mine = Scenario.from_text(text, folder=tmp_path)
    mine.save(tmp_path / "mine.yaml")
    assert Scenario.load(tmp_path / "mine.yaml") == mine
    given: dict[str, Any] = {
        "slack_weight": 50.5,
        "local_activation": False,
        "look_ahead.tries": 30,
        "look_ahead.delay": 0.2,
        "planner.patience": 2.0,
        "planner.search.margin": 0.08,
        "planner.search.max_nodes": 500,
        "planner.route.lead": 0.3,
        "safety.margin": 0.012345678901234,
        "safety.max_rows": 8,
        "speed_limits.near_speed": 0.125,
        "period": 0.002,  # of the simulation
        "synchronous": True,
    }
    settings = controller_settings_of(mine)
    assert settings.local_minimum is None
    assert settings.output.name == "acceleration"
    for field in controller_settings_fields():
        name = str(field["name"])
        if not name.startswith("local_minimum."):
            assert attrgetter(name)(settings) == given.get(name, field["default"]), name


@pytest.mark.parametrize(
    ("method", "missing"),
    [
        ("controller", set()),
        ("barrier", {"planner"}),
        ("reactive", {"planner", "look_ahead", "local_minimum"}),
    ],
)
def test_methods_are_the_controller_without_parts(method: str, missing: set[str]) -> None:
    text = BASE + f"method: {method}\ncontroller: {{look_ahead: {{tries: 30}}}}\n"
    settings = controller_settings_of(parse(text))
    assert {name for name in OPTIONAL if getattr(settings, name) is None} == missing
    if settings.look_ahead is not None:
        assert settings.look_ahead.tries == 30


@pytest.mark.parametrize(
    ("section", "added"), [("{}", False), ("{speed_limits: null}", False), ("{speed_limits: {}}", True)]
)
def test_a_part_that_is_off_is_added_by_a_section_however_empty(
    tmp_path: Path, section: str, added: bool
) -> None:
    mine = Scenario.from_text(BASE + f"method: reactive\ncontroller: {section}\n", folder=tmp_path)
    mine.save(tmp_path / "mine.yaml")
    assert Scenario.load(tmp_path / "mine.yaml") == mine
    limits = controller_settings_of(mine).speed_limits
    assert (limits is not None) == added
    assert limits is None or limits.far_speed == SpeedLimitSettings().far_speed


def test_the_thesis_s_torque_program_has_the_numbers_of_the_section() -> None:
    text = "controller: {slack_weight: 50.5, planner: null, safety: {margin: 0.02}, barriers: {power: 3}}"
    scenario = parse(BASE + text)
    numbers = program_from(scenario.controller)
    safety = numbers.pop("safety")
    assert numbers["slack_weight"] == 50.5
    assert numbers["stop_time"] == ss.ControllerSettings().stop_time
    assert (safety.margin, safety.rate) == (0.02, SafetySettings().rate)
    assert torque_qp_of(scenario, ss.Robot.named("planar2")).num_coordinates == 2


def test_what_python_gives_a_section_is_checked_by_the_core() -> None:
    scenario = dataclasses.replace(parse(BASE), method="controller")
    for section, message in (
        ({"barrier": {}}, "has no setting 'barrier'; it has: period, "),
        ({"safety": {"margin": -1.0}}, r"safety\S* ?margin is -1"),
        ({"barriers": None}, "barriers is None, must be BarrierSettings"),
        ({"stop_time": "1"}, r"stop_time is '1', must be a number \[s\]"),
    ):
        with pytest.raises(ValueError, match=message):
            controller_settings_of(dataclasses.replace(scenario, controller=section))
