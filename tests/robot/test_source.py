"""Files, packages and xacro."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from sidestep.robot import Robot, planar_arm
from sidestep.robot.srdf import read_srdf

MESH_URDF = re.sub(r"<box [^>]*/>", '<mesh filename="{}" scale="2 1 -1"/>', planar_arm(1), count=1)


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    """packages/arm/{urdf,meshes}, the mesh a box 1 x 2 x 3 m with its corner at the origin."""
    (tmp_path / "arm" / "meshes").mkdir(parents=True)
    (tmp_path / "arm" / "urdf").mkdir()
    box = trimesh.creation.box(bounds=[[0, 0, 0], [1, 2, 3]])
    box.export(tmp_path / "arm" / "meshes" / "box.stl")
    return tmp_path


def check_mesh(robot: Robot) -> None:
    mesh = robot.collision_mesh("link1")
    assert mesh is not None
    # the file's box, scaled by (2, 1, -1), then moved by the origin 0.25 0 0; STL holds float32
    np.testing.assert_allclose(mesh.bounds, [[0.25, 0, -3], [2.25, 2, 0]], atol=1e-6)
    assert mesh.volume == pytest.approx(
        12.0, rel=1e-6
    )  # positive: the mirror did not turn the mesh inside out


@pytest.mark.parametrize("uri", ["package://arm/meshes/box.stl", "../meshes/box.stl"])
def test_references_from_a_file(packages: Path, uri: str) -> None:
    path = packages / "arm" / "urdf" / "arm.urdf"
    path.write_text(MESH_URDF.format(uri))
    check_mesh(Robot.from_urdf(path))


def test_references_from_a_string(packages: Path) -> None:
    check_mesh(Robot.from_urdf(MESH_URDF.format("package://arm/meshes/box.stl"), package_dirs=[packages]))
    check_mesh(
        Robot.from_urdf(MESH_URDF.format("package://arm/meshes/box.stl"), package_dirs=[packages / "arm"])
    )
    check_mesh(Robot.from_urdf(MESH_URDF.format((packages / "arm/meshes/box.stl").as_uri())))
    check_mesh(Robot.from_urdf(MESH_URDF.format(packages / "arm/meshes/box.stl")))
    with pytest.raises(
        ValueError, match=r"'http://x/box.stl'; allowed: package://, model://, file:// and plain paths"
    ):
        Robot.from_urdf(MESH_URDF.format("http://x/box.stl"))


def test_collada_unit_is_applied(packages: Path) -> None:
    box = trimesh.creation.box(bounds=[[0, 0, 0], [1000, 2000, 3000]])
    path = packages / "arm" / "meshes" / "box.dae"
    box.export(path)
    text, count = re.subn(
        r"<asset>", '<asset><unit name="millimeter" meter="0.001"/>', path.read_text(), count=1
    )
    assert count == 1
    path.write_text(re.sub(r'<unit[^>]*meter="1(\.0)?"[^>]*/>', "", text))
    check_mesh(Robot.from_urdf(MESH_URDF.format(path)))


def test_unreadable_mesh(packages: Path) -> None:
    path = packages / "broken.obj"
    path.write_text("v 0 0 0\nf 1 2 3\n")
    robot = Robot.from_urdf(MESH_URDF.format(path))
    with pytest.raises(ValueError, match=r"mesh file .*broken.obj"):
        robot.collision_mesh("link1")


def test_a_mesh_without_triangles_is_refused_with_its_link(packages: Path) -> None:
    for name, content in (
        ("points.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"),
        ("points.ply", "ply\nformat ascii 1.0\nelement vertex 1\nelement face 0\nend_header\n0 0 0\n"),
    ):
        (packages / name).write_text(content)
        with pytest.raises(ValueError, match=rf"link 'link1' refers to '.*{name}', which holds no triangles"):
            Robot.from_urdf(MESH_URDF.format(packages / name))


@pytest.mark.parametrize(
    "rest",
    [
        "../../other.stl",
        "meshes/../../other.stl",
        "meshes/./../../arm/meshes/box.stl",  # out and in again: where a package stands is nobody's business
        "%2e%2e/other.stl",
        "meshes%2f..%2F..%2fother.stl",
        "..\\..\\other.stl",
        "meshes\\..\\..\\other.stl",
        "%5C..%5C../other.stl",
        "//../other.stl",
        "C:/other.stl",
        "meshes/box.stl%00",
    ],
)
def test_a_package_reference_stays_in_its_package(packages: Path, rest: str) -> None:
    (packages / "other.stl").write_bytes((packages / "arm" / "meshes" / "box.stl").read_bytes())
    with pytest.raises(ValueError, match=r"refers to .*which leaves the package; allowed: a file below"):
        Robot.from_urdf(MESH_URDF.format(f"package://arm/{rest}"), package_dirs=[packages])
    with pytest.raises(ValueError, match="leaves the package"):
        Robot.from_urdf(MESH_URDF.format(f"package://arm/{rest}"), package_dirs=[packages / "arm"])


@pytest.mark.parametrize("package", ["..", ".", "%2e%2e", "arm%2f..%2f..", "arm%5c..%5c.."])
def test_a_package_has_a_name_and_no_path(packages: Path, package: str) -> None:
    with pytest.raises(ValueError, match="leaves the package"):
        Robot.from_urdf(MESH_URDF.format(f"package://{package}/box.stl"), package_dirs=[packages / "arm"])


@pytest.mark.parametrize(
    "rest", ["urdf/../meshes/box.stl", "urdf/..\\meshes\\box.stl", "absent/../meshes//./box%2Estl"]
)
def test_a_package_reference_may_go_up_inside(packages: Path, rest: str) -> None:
    check_mesh(Robot.from_urdf(MESH_URDF.format(f"package://arm/{rest}"), package_dirs=[packages]))


def test_a_reference_that_is_no_address(packages: Path) -> None:
    with pytest.raises(ValueError, match=r"link 'link1' refers to 'package://\[arm/x', which is no address"):
        Robot.from_urdf(MESH_URDF.format("package://[arm/x"), package_dirs=[packages])


NAMED = '<?xml version="1.0" encoding="{}"?>\n' + planar_arm(1).replace("link1", "Glied-Ä")


@pytest.mark.parametrize(
    ("declared", "codec"),
    [
        ("UTF-8", "utf-8"),
        ("utf-8", "utf-8-sig"),
        ("UTF-16", "utf-16"),
        ("ISO-8859-1", "latin-1"),
        ("windows-1252", "cp1252"),
        ("GB18030", "gb18030"),  # more than one byte a character: expat knows none of these
    ],
)
def test_a_description_is_read_in_the_encoding_that_it_declares(
    tmp_path: Path, declared: str, codec: str
) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(NAMED.format(declared).encode(codec))
    assert [link.name for link in Robot.from_urdf(path).links if "Glied" in link.name] == ["Glied-Ä"]
    assert Robot.from_urdf(NAMED.format(declared)).link("Glied-Ä").name == "Glied-Ä"


@pytest.mark.parametrize("declared", ["nonsense", "zip", "rot13", "x-user-defined", "undefined", ""])
def test_an_unknown_encoding_is_named(tmp_path: Path, declared: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(NAMED.format(declared))
    for read in (lambda: Robot.from_urdf(path), lambda: read_srdf(path, [])):
        with pytest.raises(
            ValueError, match=rf"arm\.urdf declares the encoding '{declared}'.*allowed: UTF-8"
        ) as e:
            read()
        assert "\n" not in str(e.value)


def test_bytes_that_are_not_in_the_encoding_are_named(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(NAMED.format("UTF-8").encode("latin-1"))
    with pytest.raises(ValueError, match=r"arm\.urdf is not UTF-8 text \(byte \d+: .*; allowed: UTF-8, or"):
        Robot.from_urdf(path)


def test_a_description_that_multiplies_or_calls_itself_is_refused() -> None:
    laughs = "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 12))
    text = f'<!DOCTYPE robot [<!ENTITY a0 "x">{laughs}]><robot name="&a11;"/>'
    with pytest.raises(ValueError, match="URDF string is not well-formed XML"):
        Robot.from_urdf(text)
    endless = PART.replace('<link name="base"/>', '<xacro:part length="1"/>', 1)
    endless = endless.replace("</robot>", '<xacro:part length="1"/></robot>')
    with pytest.raises(ValueError, match="URDF string: xacro expansion failed: RecursionError"):
        Robot.from_urdf(endless)


XACRO = """<robot name="made" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="reach" default="0.3"/>
  <xacro:include filename="$(find arm)/urdf/part.xacro"/>
  <xacro:part length="$(arg reach)"/>
</robot>"""
PART = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="part" params="length">
    <link name="base"/><link name="arm"/><link name="tip"/>
    <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
    <joint name="end" type="fixed">
      <parent link="arm"/><child link="tip"/><origin xyz="${2 * length} 0 0"/>
    </joint>
  </xacro:macro>
</robot>"""


def test_xacro(packages: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (packages / "arm" / "urdf" / "part.xacro").write_text(PART)
    path = packages / "arm" / "urdf" / "arm.xacro"
    path.write_text(XACRO)
    assert Robot.from_urdf(path).pose([0.0], "tip")[0, 3] == pytest.approx(0.6)
    longer = Robot.from_urdf(XACRO, package_dirs=[packages], xacro_arguments={"reach": "0.5"})
    assert longer.name == "made"
    assert longer.pose([0.0], "tip")[0, 3] == pytest.approx(1.0)
    assert capfd.readouterr() == ("", "")
    with pytest.raises(
        ValueError, match=r"xacro expansion failed: .*\$\(find arm\): no such package; searched in"
    ):
        Robot.from_urdf(XACRO)
    with pytest.raises(ValueError, match=r"uses no xacro, but xacro_arguments are given: \['reach'\]"):
        Robot.from_urdf(planar_arm(2), xacro_arguments={"reach": "1"})


def test_a_package_of_xacro_that_is_not_found_is_the_folder_with_the_file(packages: Path) -> None:
    """Folders of a repository are given other names than their packages have."""
    (packages / "arm" / "urdf" / "part.xacro").write_text(PART)
    path = packages / "arm" / "urdf" / "arm.xacro"
    path.write_text(XACRO.replace("$(find arm)", "$(find arm_support)"))
    with pytest.warns(
        RuntimeWarning, match=r"there is no package 'arm_support'; .*arm is taken for it"
    ) as said:
        robot = Robot.from_urdf(path)
    assert robot.pose([0.0], "tip")[0, 3] == pytest.approx(0.6)
    assert len(said) == 1
    (packages / "arm" / "urdf" / "part.xacro").unlink()
    with pytest.raises(ValueError, match=r"\$\(find arm_support\): no such package; searched in"):
        Robot.from_urdf(path)


DECLARED = '<robot name="planar1" xmlns:xacro="http://www.ros.org/wiki/xacro">'


def test_expressions_alone_are_xacro(tmp_path: Path) -> None:
    text = re.sub(r'velocity="[^"]*"', 'velocity="${radians(120)}"', planar_arm(1))
    named = tmp_path / "arm.urdf.xacro"
    named.write_text(text)
    declared = re.sub("<robot [^>]*>", DECLARED, text)
    for source in (named, declared):
        assert Robot.from_urdf(source).limits.velocity == pytest.approx([2 * np.pi / 3])
    with pytest.raises(ValueError, match=r"velocity is '\$\{radians\(120\)\}', must be a number"):
        Robot.from_urdf(text)  # nothing says that it is xacro
    with pytest.raises(ValueError, match=r"xacro expansion failed: .*'prefix' is not defined"):
        Robot.from_urdf(declared.replace('"link1"', '"${prefix}link1"'))
    written = re.sub("<robot [^>]*>", DECLARED, planar_arm(1)).replace("</robot>", "<x>${y}</x></robot>")
    assert Robot.from_urdf(written).num_coordinates == 1  # text between elements is another program's


ARGUMENTS = re.sub(
    "<robot [^>]*>",
    DECLARED + '<xacro:arg name="speed" default="1"/><xacro:arg name="fast" default="false"/>'
    '<xacro:property name="v" value="$(arg speed)"/><xacro:if value="$(arg fast)"><xacro:property name="v" value="9"/>'
    "</xacro:if>",
    re.sub(r'velocity="[^"]*"', 'velocity="${v}"', planar_arm(1)),
)


@pytest.mark.parametrize(
    ("arguments", "velocity"),
    [({"speed": 0.05}, 0.05), ({"speed": 3}, 3), ({"speed": np.float64(0.5)}, 0.5), ({"fast": True}, 9),
     ({"fast": np.bool_(False)}, 1), ({"fast": "true", "speed": "2"}, 9)],
)  # fmt: skip
def test_arguments_of_xacro_may_be_numbers_and_truth_values(
    arguments: dict[str, float], velocity: float
) -> None:
    assert Robot.from_urdf(ARGUMENTS, xacro_arguments=arguments).limits.velocity == pytest.approx([velocity])


def test_arguments_that_a_file_does_not_have_are_refused(tmp_path: Path) -> None:
    known = r"'sped', which no <xacro:arg> defines; those of the file are: fast, speed"
    with pytest.raises(ValueError, match=known):
        Robot.from_urdf(ARGUMENTS, xacro_arguments={"speed": 2, "sped": 3})
    with pytest.raises(ValueError, match=r"'speed' is \[1\], must be a text, a number, True or False"):
        Robot.from_urdf(ARGUMENTS, xacro_arguments={"speed": [1]})  # type: ignore[dict-item]
    part = tmp_path / "part.xacro"
    part.write_text(f'{DECLARED}<xacro:arg name="more" default="1"/></robot>')
    include = f'<xacro:include filename="{part}"/>'
    whole = ARGUMENTS.replace("</robot>", include + "</robot>")
    assert Robot.from_urdf(whole, xacro_arguments={"more": 3}).num_coordinates == 1
    perhaps = ARGUMENTS.replace("</robot>", f'<xacro:if value="$(arg fast)">{include}</xacro:if></robot>')
    with pytest.warns(RuntimeWarning, match="'more', which no .* on a condition may have more") as said:
        Robot.from_urdf(perhaps, xacro_arguments={"more": 3})
    assert said[0].filename == __file__
    Robot.from_urdf(perhaps, xacro_arguments={"more": 3, "fast": True})


def test_a_file_that_includes_itself_is_named(tmp_path: Path) -> None:
    path = tmp_path / "round.xacro"
    path.write_text(f'{DECLARED}<xacro:include filename="round.xacro"/></robot>')
    with pytest.raises(ValueError, match=r"RecursionError: .*round\.xacro is included in itself"):
        Robot.from_urdf(path)
