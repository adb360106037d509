"""Files that are no URDF say what they are and how to convert them."""

from pathlib import Path

import pytest

from sidestep.robot import Robot

MACRO = (
    '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="arm" params="prefix side:=left *origin">'
    '<link name="${prefix}"/></xacro:macro></robot>'
)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "a.sdf",
            '<sdf version="1.7"><model name="a"/></sdf>',
            r"<sdf>, must be <robot>; it is SDF, .*sdf2urdf",
        ),
        ("a.urdf", '<?xml version="1.0"?><sdf/>', "it is SDF"),
        (
            "a.step",
            "ISO-10303-21;\nHEADER;",
            "is a STEP file, not URDF: it holds shapes without joints; export URDF",
        ),
        ("a.urdf", "ISO-10303-21;\nHEADER;", "is a STEP file"),
        ("a.stl", "\0" * 100, "is a mesh, not URDF: it holds a shape without joints; write a URDF"),
        ("a.urdf", "solid cube\n", "is an STL mesh, not URDF"),
        ("a.dae", '<COLLADA version="1.4.1"/>', "it is a COLLADA mesh: it holds a shape without joints"),
        ("a.usda", "#usda 1.0\n", "is a USD file, not URDF: export URDF"),
        (
            "a.urdf",
            "version https://git-lfs.github.com/spec/v1\noid",
            "is a Git LFS pointer, not the file itself",
        ),
        ("a.urdf", " \n", "is empty; a URDF begins with <robot>"),
    ],
)
def test_another_format_is_named(tmp_path: Path, name: str, content: str, message: str) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(ValueError, match=message):
        Robot.from_urdf(path)


def test_macros_alone_say_how_to_call_them(tmp_path: Path) -> None:
    path = tmp_path / "arm_macro.xacro"
    path.write_text(MACRO)
    with pytest.raises(ValueError, match="defines the xacro macros arm and calls none") as caught:
        Robot.from_urdf(path)
    assert '<xacro:include filename="arm_macro.xacro"/><xacro:arm prefix="…" side="…"/>' in str(caught.value)
    caller = tmp_path / "arm.xacro"
    caller.write_text(
        '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="arm_macro.xacro"/>'
        '<xacro:arm prefix="base"><origin/></xacro:arm></robot>'
    )
    with pytest.raises(ValueError, match="has no movable joint left"):
        Robot.from_urdf(caller)
