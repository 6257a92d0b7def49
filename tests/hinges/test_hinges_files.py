"""Files of a box with its lid: one object of named, coloured parts, in slicers and in CAD."""

import io
import json
import re
import shutil
import subprocess
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from build123d import Align, Box, Color, Pos, import_step

from hinges import HingeError, SingleHinge, write_3mf, write_step

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
MATERIAL = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"


@pytest.fixture(scope="module")
def lidded():
    """Two boards with a hinge between them, side by side as they print."""
    hinge = SingleHinge(40, clearance=0.4)
    low = (Align.MAX, Align.MAX, Align.CENTER)
    box = Pos(-0.2, 0) * Box(30, 12, 40, align=low)
    lid = Pos(0.2, 0) * Box(30, 12, 40, align=(Align.MIN, Align.MAX, Align.CENTER))
    return hinge.fit(box, lid)


def package(path):
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


def meshes_of(model):
    """Vertices and faces of every object with a mesh, by number."""
    found = {}
    for item in model.iter(f"{CORE}object"):
        mesh = item.find(f"{CORE}mesh")
        if mesh is None:
            continue
        points = [[float(v.get(k)) for k in "xyz"] for v in mesh.iter(f"{CORE}vertex")]
        faces = [[int(t.get(k)) for k in ("v1", "v2", "v3")] for t in mesh.iter(f"{CORE}triangle")]
        found[item.get("id")] = (item.get("name"), np.array(points), np.array(faces))
    return found


def volume(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def is_closed(faces):
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = {tuple(edge) for edge in edges.tolist()}
    return len(there) == len(edges) and all((b, a) in there for a, b in there)


def test_prusa_sees_one_object_of_named_parts(lidded, tmp_path):
    path = write_3mf(lidded, tmp_path / "box.3mf", names=["box", 'lid "top"'])
    entries = package(path)
    model = ElementTree.fromstring(entries["3D/3dmodel.model"])
    meshes = meshes_of(model)
    assert len(meshes) == 1
    assert len(model.find(f"{CORE}build")) == 1
    _, points, faces = meshes["1"]
    config = ElementTree.fromstring(entries["Metadata/Slic3r_PE_model.config"])
    parts = list(config.iter("volume"))
    names = [
        next(m.get("value") for m in part.iter("metadata") if m.get("key") == "name")
        for part in parts
    ]
    assert names == ["box", 'lid "top"']
    ranges = [(int(part.get("firstid")), int(part.get("lastid"))) for part in parts]
    assert ranges[0][0] == 0
    assert ranges[0][1] + 1 == ranges[1][0]
    assert ranges[1][1] + 1 == len(faces)
    for (first, last), part in zip(ranges, lidded, strict=True):
        mine = faces[first : last + 1]
        assert is_closed(mine)
        assert volume(points, mine) == pytest.approx(part.volume, rel=2e-3)
    colours = [c.get("color") for c in model.iter(f"{MATERIAL}color")]
    assert len(set(colours)) == 2
    assert all(re.fullmatch(r"#[0-9A-F]{6}FF", colour) for colour in colours)
    (whole,) = model.iter(f"{CORE}object")  # what a triangle does not tell, its object does
    paint = [t.get("p1", whole.get("pindex")) for t in model.iter(f"{CORE}triangle")]
    assert paint == ["0"] * (ranges[0][1] + 1) + ["1"] * (ranges[1][1] + 1 - ranges[1][0])


def test_bambu_sees_one_object_of_named_parts(lidded, tmp_path):
    path = write_3mf(
        lidded, tmp_path / "box.3mf", names=["box", "lid"], colours=["#ff0000", "#00FF00"],
        slicer="bambu", title="my box",
    )  # fmt: skip
    entries = package(path)
    model = ElementTree.fromstring(entries["3D/3dmodel.model"])
    meshes = meshes_of(model)
    assert [name for name, _, _ in meshes.values()] == ["box", "lid"]
    for (_, points, faces), part in zip(meshes.values(), lidded, strict=True):
        assert is_closed(faces)
        assert volume(points, faces) == pytest.approx(part.volume, rel=2e-3)
    (item,) = model.find(f"{CORE}build")
    whole = item.get("objectid")
    (owner,) = [o for o in model.iter(f"{CORE}object") if o.find(f"{CORE}components") is not None]
    assert owner.get("id") == whole
    assert [c.get("objectid") for c in owner.iter(f"{CORE}component")] == list(meshes)
    config = ElementTree.fromstring(entries["Metadata/model_settings.config"])
    (thing,) = config.iter("object")
    assert thing.get("id") == whole
    assert thing.find("metadata").get("value") == "my box"
    told = {
        part.get("id"): {m.get("key"): m.get("value") for m in part} for part in config.iter("part")
    }
    assert [told[number]["name"] for number in meshes] == ["box", "lid"]
    assert [told[number]["extruder"] for number in meshes] == ["1", "2"]
    project = json.loads(entries["Metadata/project_settings.config"])
    assert project["filament_colour"] == ["#FF0000", "#00FF00"]


def test_lib3mf_reads_both(lidded, tmp_path):
    import lib3mf

    for slicer, objects in (("prusa", 1), ("bambu", 2)):
        path = write_3mf(lidded, tmp_path / f"{slicer}.3mf", slicer=slicer)
        model = lib3mf.get_wrapper().CreateModel()
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(True)
        reader.ReadFromFile(str(path))
        assert reader.GetWarningCount() == 0
        meshes = model.GetMeshObjects()
        assert meshes.Count() == objects


def test_the_same_parts_give_the_same_bytes(lidded, tmp_path):
    one = write_3mf(lidded, tmp_path / "one.3mf", title="box").read_bytes()
    other = write_3mf(lidded, tmp_path / "other.3mf", title="box").read_bytes()
    assert one == other


@pytest.mark.slow
def test_prusaslicer_slices_it(lidded, tmp_path):
    slicer = shutil.which("prusa-slicer")
    if slicer is None:
        pytest.skip("PrusaSlicer is not installed")
    path = write_3mf(lidded, tmp_path / "box.3mf")
    done = subprocess.run(
        [slicer, "--export-gcode", "--center", "100,100", "-o", tmp_path / "x.gcode", path],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "x.gcode").stat().st_size > 10_000


def test_step_has_a_product_a_part(lidded, tmp_path):
    path = write_step(lidded, tmp_path / "box.step", names=["box", "lid"], title="hinged-box")
    text = path.read_text(encoding="utf-8")
    products = re.findall(r"PRODUCT\('([^']*)'", text)
    assert {"hinged-box", "box", "lid"} <= set(products)
    again = import_step(str(path))
    assert again.label == "hinged-box"
    assert [child.label for child in again.children] == ["box", "lid"]
    assert [child.volume for child in again.children] == pytest.approx(
        [part.volume for part in lidded], rel=1e-6
    )
    assert not list(tmp_path.glob("tmp*"))


def test_labels_and_colours_of_parts_are_kept(tmp_path):
    one, other = Box(4, 4, 4), Pos(6) * Box(4, 4, 4)
    one.label, one.color = "base", Color(1.0, 0.5, 0.0)
    entries = package(write_3mf([one, other], tmp_path / "two.3mf"))
    assert b'value="base"' in entries["Metadata/Slic3r_PE_model.config"]
    assert b'value="part 2"' in entries["Metadata/Slic3r_PE_model.config"]
    assert b"#FF8000FF" in entries["3D/3dmodel.model"]


@pytest.mark.parametrize(
    ("parts", "name", "options", "told"),
    [
        ([], "x.3mf", {}, "there is no part"),
        ([Box(1, 1, 1)], "x.stl", {}, "must end in .3mf"),
        ([Box(1, 1, 1)], "none/x.3mf", {}, "there is no folder"),
        ([Box(1, 1, 1)], "x.3mf", {"names": ["a", "b"]}, "1 parts, but 2 names"),
        ([Box(1, 1, 1)], "x.3mf", {"names": ["a\nb"]}, "letters that can be read"),
        ([Box(1, 1, 1)], "x.3mf", {"colours": ["red"]}, "write it as #RRGGBB"),
        ([Box(1, 1, 1)], "x.3mf", {"colours": []}, "1 parts, but 0 colours"),
        ([Box(1, 1, 1)], "x.3mf", {"slicer": "cura"}, "choose"),
        ([Box(1, 1, 1)], "x.3mf", {"tolerance": 0.0}, "a length in mm above 0"),
        ([io.StringIO()], "x.3mf", {}, "it has no solid"),
    ],
)
def test_what_makes_no_sense_is_refused(parts, name, options, told, tmp_path):
    with pytest.raises(HingeError, match=told):
        write_3mf(parts, tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []
