"""Meshes: what cannot be read is named, and coarse ones keep the shape."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from sidestep.obstacles import MeshShape
from sidestep.shapes.mesh_reader import read_mesh, simplified


def test_files_that_are_no_mesh_are_named(tmp_path: Path) -> None:
    broken = tmp_path / "broken.stl"
    broken.write_bytes(b"solid x")
    with pytest.raises(ValueError, match=r"mesh file '.*broken\.stl' is truncated: it ends in its header"):
        read_mesh(broken)
    empty = tmp_path / "points.obj"
    empty.write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match=r"mesh file '.*points\.obj' (cannot be read|holds no triangles)"):
        read_mesh(empty)


def test_a_file_is_read_in_its_own_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "box.stl"
    trimesh.creation.box(extents=(100.0, 200.0, 300.0)).export(path)
    np.testing.assert_allclose(read_mesh(path).extents, [100.0, 200.0, 300.0])


def test_simplified_keeps_the_shape() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    coarse = simplified(sphere, 0.02)
    assert len(coarse.faces) < len(sphere.faces) / 10
    radii = np.linalg.norm(coarse.vertices, axis=1)
    # the mean of vertices in a cube of side c is off the sphere by at most its diagonal
    assert radii.max() <= 0.1 + 1e-12
    assert radii.min() >= 0.1 - 0.02 * np.sqrt(3)
    np.testing.assert_allclose(coarse.bounds, sphere.bounds, atol=0.01)


POINTS = "0 0 0 1 0 0 0 1 0 0 0 1"
PART = """<geometry id="g{k}"><mesh><source id="p{k}"><float_array id="a{k}" count="12">{points}</float_array>
<technique_common><accessor source="#a{k}" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v{k}"><input semantic="POSITION"
source="#p{k}"/></vertices><triangles material="m{k}" count="4"><input semantic="VERTEX" source="#v{k}" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry>"""
NODE = """<node><instance_geometry url="#g{k}"><bind_material><technique_common><instance_material symbol="m{k}"
target="#m{k}"/></technique_common></bind_material></instance_geometry></node>"""


def collada(extra: str = "", nodes: str = NODE.format(k=1) + NODE.format(k=2)) -> str:
    """Two tetrahedra, 5 m apart; their materials are in `extra` or nowhere."""
    parts = PART.format(k=1, points=POINTS) + PART.format(k=2, points="5 0 0 6 0 0 5 1 0 5 0 1")
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>'
        f"{extra}<library_geometries>{parts}</library_geometries><library_visual_scenes><visual_scene id='s'>{nodes}"
        '</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


EFFECT = """<library_effects><effect id="e"><profile_COMMON><newparam sid="t"><sampler2D>
<source>gone</source></sampler2D></newparam>
<technique sid="c"><phong><diffuse><texture texture="t" texcoord="U"/></diffuse></phong></technique>
</profile_COMMON></effect></library_effects>"""
MATERIALS = '<library_materials><material id="m2"><instance_effect url="#{}"/></material></library_materials>'


@pytest.mark.parametrize(
    "extra", ["", EFFECT, EFFECT + MATERIALS.format("e"), MATERIALS.format("gone"),
              '<library_images><image id="i"><init_from>gone.png</init_from></image></library_images>',
              '<library_lights><light id="l"/></library_lights>']
)  # fmt: skip
def test_broken_materials_do_not_take_parts_away(tmp_path: Path, extra: str) -> None:
    path = tmp_path / "two.dae"
    path.write_text(collada(extra))
    mesh = read_mesh(path)
    assert len(mesh.faces) == 8
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [6, 1, 1]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<triangles", "<tristrips", "triangle strips"),
        ('url="#g2"', 'url="#gone"', "cannot be read: .*gone"),
        ('source="#p2"', 'source="#gone"', "cannot be read"),
        ("<instance_geometry", "<instance_controller", "a skinned or morphed shape"),
        ("<p>0 2 1", "<p>0 2 x", "cannot be read"),
    ],
)
def test_a_part_that_does_not_arrive_is_an_error(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "two.dae"
    path.write_text(collada().replace(old, new).replace(f"</{old[1:]}>", f"</{new[1:]}>"))
    with pytest.raises(ValueError, match=rf"mesh file '.*two\.dae' .*{message}"):
        read_mesh(path)


def test_the_format_is_that_of_the_content(tmp_path: Path) -> None:
    box = trimesh.creation.box(extents=(1.0, 2.0, 3.0))
    for name, kind in (
        ("no_suffix", "stl"),
        ("wrong.obj", "stl_ascii"),
        ("wrong.stl", "ply"),
        ("wrong.dae", "glb"),
    ):
        content = box.export(file_type=kind)
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        np.testing.assert_allclose(read_mesh(tmp_path / name).extents, [1.0, 2.0, 3.0])


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "glb", "dae"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_vertices_that_are_not_finite_are_refused(tmp_path: Path, kind: str, value: float) -> None:
    """A reader that leaves their triangles out leaves a hole in what is avoided."""
    path = tmp_path / f"bad.{kind.removesuffix('_ascii')}"
    if kind == "dae":
        path.write_text(collada().replace("5 1 0 5 0 1", f"5 {value} 0 5 0 1"))
        count = "1 of 8"
    else:
        box = trimesh.creation.box()
        vertices = np.array(box.vertices)
        vertices[3, 0] = value
        content = trimesh.Trimesh(vertices, box.faces, process=False).export(file_type=kind)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        corners = np.sum(box.faces == 3)  # an STL repeats a vertex in each of its triangles
        count = f"{corners} of 36" if "stl" in kind else "1 of 8"
    message = rf"mesh file '.*bad\.\w+' .*holds vertices that are not finite \(nan or inf\): {count}\b"
    with pytest.raises(ValueError, match=message):
        read_mesh(path)
    for use in (MeshShape(path).mesh, MeshShape(path).balls, lambda: MeshShape(path).sample(0.1)):
        with pytest.raises(ValueError, match=message):
            use()


def test_coordinates_that_overflow_in_the_reader_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "far.dae"
    path.write_text(collada().replace("5 1 0 5 0 1", "5 1e39 0 5 0 1"))
    with pytest.raises(ValueError, match=r"not finite \(nan or inf\): 1 of 8"):
        read_mesh(path)


@pytest.mark.parametrize("word", ["-nan(ind)", "-1.#IND", "1.#QNAN", "1e999", "NaN", "x"])
@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "dae"])
def test_words_that_are_no_finite_numbers_are_refused(tmp_path: Path, kind: str, word: str) -> None:
    path = tmp_path / f"bad.{kind}"
    if kind == "dae":
        text = collada().replace("5 1 0 5 0 1", f"5 {word} 0 5 0 1")
    else:
        box = trimesh.creation.box((2.0, 4.0, 6.0))
        export = {"stl": {"file_type": "stl_ascii"}, "obj": {"file_type": "obj"},
                  "ply": {"file_type": "ply", "encoding": "ascii"}}[kind]  # fmt: skip
        content = box.export(**export)
        content = content if isinstance(content, str) else content.decode()
        text = re.sub(r"(?<=[ \n])-?2\.0*(?= )", word, content, count=1)
        assert word in text
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"mesh file '.*bad\.{kind}' "):
        read_mesh(path)


def test_a_place_that_is_not_finite_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "moved.dae"
    path.write_text(collada(nodes=NODE.format(k=1).replace("<node>", "<node><translate>0 nan 0</translate>")))
    with pytest.raises(ValueError, match=r"not finite \(nan or inf\): 4 of 4"):
        read_mesh(path)
