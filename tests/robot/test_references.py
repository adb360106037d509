"""References to packages and files of other machines, and mesh files that cannot be used."""

import re
import warnings
from pathlib import Path

import pytest
import trimesh

from sidestep.robot import Robot, planar_arm

ONE = re.sub(r"<box [^>]*/>", '<mesh filename="{}"/>', planar_arm(1), count=1)
SHAPE = re.compile(r"<collision>.*?</collision>", re.DOTALL)


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """src/{folder_a,folder_b}, of the packages arm_description and parts; the mesh is in the second."""
    for folder, name in (("folder_a", "arm_description"), ("folder_b", "parts")):
        (tmp_path / "src" / folder / "meshes").mkdir(parents=True)
        (tmp_path / "src" / folder / "package.xml").write_text(
            f"<package>\n <name>\n {name} </name></package>"
        )
    (tmp_path / "src" / "folder_a" / "urdf").mkdir()
    trimesh.creation.box(extents=(1, 2, 3)).export(tmp_path / "src" / "folder_b" / "meshes" / "box.stl")
    return tmp_path / "src"


def check(robot: Robot) -> None:
    mesh = robot.collision_mesh("link1")
    assert mesh is not None
    assert mesh.extents.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    "uri", ["package://parts/meshes/box.stl", "model://parts/meshes/box.stl", "file://$(find parts)/meshes/box.stl",
            "$(find parts)/meshes/box.stl"]
)  # fmt: skip
def test_a_package_is_found_by_the_name_in_its_manifest(workspace: Path, uri: str) -> None:
    path = workspace / "folder_a" / "urdf" / "arm.urdf"
    path.write_text(ONE.format(uri))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(Robot.from_urdf(path))
        check(Robot.from_urdf(ONE.format(uri), package_dirs=[workspace]))
        check(Robot.from_urdf(ONE.format(uri), package_dirs=[workspace / "folder_b"]))
        check(Robot.from_urdf(ONE.format(uri), package_dirs=[workspace.parent]))
    with pytest.raises((FileNotFoundError, ValueError), match="parts"):
        Robot.from_urdf(ONE.format(uri), package_dirs=[workspace / "folder_a"])


@pytest.mark.parametrize(
    "uri",
    [
        "file:///home/someone/ws/install/share/parts/meshes/box.stl",
        "/opt/ros/share/parts/meshes/box.stl",
        "file:///C:/Users/me/parts/meshes/box.stl",
        r"C:\Users\me\parts\meshes\box.stl",
        "package://never_heard_of/meshes/box.stl",
        "model://never_heard_of/meshes/box.stl",
    ],
)
def test_a_path_of_another_machine_is_found_by_its_tail(workspace: Path, uri: str) -> None:
    path = workspace / "folder_b" / "arm.urdf"
    path.write_text(ONE.format(uri))
    with pytest.warns(
        RuntimeWarning, match=r"box\.stl' at .*folder_b/meshes/box\.stl: is found elsewhere than"
    ):
        check(Robot.from_urdf(path))
    path.write_text(ONE.format(uri.replace("meshes", "other")))
    with pytest.raises(FileNotFoundError, match="which does not exist; searched in: "):
        Robot.from_urdf(path)  # a name alone could be another link's


@pytest.mark.parametrize("uri", ["meshes/box.stl", "folder_b/meshes/box.stl", "../gone/meshes/box.stl"])
def test_a_path_relative_to_a_folder_above_is_found(workspace: Path, uri: str) -> None:
    """Of the package, or of where the program ran that wrote the file."""
    (workspace / "folder_b" / "urdf").mkdir()
    path = workspace / "folder_b" / "urdf" / "arm.urdf"
    path.write_text(ONE.format(uri))
    with pytest.warns(
        RuntimeWarning, match=r"box\.stl' at .*folder_b/meshes/box\.stl: is found elsewhere than"
    ):
        check(Robot.from_urdf(path))
    path.write_text(ONE.format("box.stl"))
    with pytest.raises(FileNotFoundError, match="which does not exist; searched in: "):
        Robot.from_urdf(path)


def test_advice_is_given_where_it_applies(workspace: Path) -> None:
    path = workspace / "folder_a" / "arm.urdf"
    path.write_text(ONE.format("meshes/gone.stl"))
    with pytest.raises(FileNotFoundError) as caught:
        Robot.from_urdf(path)
    assert "package_dirs" not in str(caught.value)
    path.write_text(ONE.format("package://nowhere/gone.stl"))
    with pytest.raises(FileNotFoundError, match="there is no package 'nowhere': pass package_dirs"):
        Robot.from_urdf(path)
    path.write_text(ONE.format("package://parts/meshes/gone.stl"))
    with pytest.raises(FileNotFoundError) as caught:
        Robot.from_urdf(path)
    assert "pass package_dirs" not in str(caught.value)


def stl(path: Path, size: float = 1.0) -> bytes:
    trimesh.creation.box(extents=(size, 2 * size, 3 * size)).export(path)
    return path.read_bytes()


def test_every_collision_mesh_that_cannot_be_used_is_named_with_why(tmp_path: Path) -> None:
    whole = stl(tmp_path / "whole.stl")
    contents = {
        "empty.stl": b"",
        "short.stl": whole[:-60],
        "pointer.dae": b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 10\n",
        "none.stl": whole[:80] + bytes(4),
        "text.stl": b"solid a\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n",
        "half.dae": b'<?xml version="1.0"?><COLLADA><library_geometries>',
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    names = [*contents, "gone.stl", "whole.stl"]
    parts = iter(names)
    text = SHAPE.sub(
        lambda _: f'<collision><geometry><mesh filename="{next(parts)}"/></geometry></collision>',
        planar_arm(len(names)),
    )
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(FileNotFoundError) as caught:
        Robot.from_urdf(tmp_path / "arm.urdf")
    lines = str(caught.value).splitlines()
    for k, (line, why) in enumerate(
        zip(
            lines,
            ("'empty.stl', which is empty (0 bytes)", "is truncated: its header says 12 triangles, 10 are there",
             "is a Git LFS pointer, not the mesh; run `git lfs pull`", "holds no triangles: its header says 0",
             "is truncated: it has no endsolid", "is truncated: it does not end with </COLLADA>",
             f"'gone.stl', which does not exist; searched in: {tmp_path}"),
            strict=True,
        )
    ):  # fmt: skip
        assert f"link 'link{k + 1}' refers to '{names[k]}'" in line
        assert why in line
    (tmp_path / "arm.urdf").write_text(text.replace("gone.stl", "whole.stl"))
    with pytest.raises(ValueError, match="Git LFS"):
        Robot.from_urdf(tmp_path / "arm.urdf")


@pytest.mark.parametrize("content", [None, b"", b"version https://git-lfs.github.com/spec/v1\n"])
def test_a_visual_that_cannot_be_used_gives_way_to_the_collision_shape(
    tmp_path: Path, content: bytes | None
) -> None:
    from sidestep.drawing.arm import arm_triangles

    if content is not None:
        (tmp_path / "gone.dae").write_bytes(content)
    visual = '<visual><geometry><mesh filename="gone.dae"/></geometry></visual>'
    path = tmp_path / "arm.urdf"
    path.write_text(planar_arm(2).replace("<collision>", visual + "<collision>"))
    with pytest.warns(
        RuntimeWarning, match="the mesh of a <visual> cannot be used; the collision shape is"
    ) as said:
        robot = Robot.from_urdf(path)
    assert len(said) == 1
    assert "link 'link1': 'gone.dae'" in str(said[0].message)
    drawn = {name: triangles for name, _, triangles in arm_triangles(robot)}
    assert {name: len(triangles) for name, triangles in drawn.items()} == {"link1": 12, "link2": 12}
    assert abs(drawn["link1"][..., 0].max() - 0.5) < 1e-12
    path.write_text(SHAPE.sub(visual, planar_arm(2)))  # now nothing else says what the links are
    with pytest.raises((FileNotFoundError, ValueError), match=r"link 'link2' refers to 'gone\.dae', which "):
        Robot.from_urdf(path)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "glb"])
def test_a_mesh_in_millimetres_is_said(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"link.{kind.partition('_')[0]}"
    box = trimesh.creation.box(extents=(100.0, 100.0, 400.0))
    path.write_bytes(
        content if isinstance(content := box.export(file_type=kind), bytes) else content.encode()
    )
    with pytest.warns(RuntimeWarning, match=r"link 'link1' \(400 m, the arm 0 m\): .*is millimetres") as said:
        Robot.from_urdf(ONE.format(path)).collision_mesh("link1")
    assert len(said) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scaled = ONE.format(path).replace("<mesh ", '<mesh scale="0.001 0.001 0.001" ')
        Robot.from_urdf(scaled).collision_mesh("link1")


def test_a_scale_of_one_number_holds_for_all_axes(tmp_path: Path) -> None:
    stl(tmp_path / "link.stl", 100.0)
    text = ONE.format(tmp_path / "link.stl").replace("<mesh ", '<mesh scale="0.001" ')
    with pytest.warns(RuntimeWarning, match="scale is one number, where three are asked for") as said:
        robot = Robot.from_urdf(text)
    assert len(said) == 1
    mesh = robot.collision_mesh("link1")
    assert mesh is not None
    assert mesh.extents == pytest.approx([0.1, 0.2, 0.3], abs=1e-9)  # STL holds float32
    with pytest.raises(ValueError, match="scale is '1 2', must be 3 finite numbers"):
        Robot.from_urdf(text.replace('scale="0.001"', 'scale="1 2"'))
    with pytest.warns(
        RuntimeWarning, match=r"the mesh is far smaller than the arm; the likely cause is a scale"
    ):
        Robot.from_urdf(
            re.sub(
                r"<box [^>]*/>",
                f'<mesh filename="{tmp_path}/link.stl" scale="1e-5 1e-5 1e-5"/>',
                planar_arm(3),
            )
        )
