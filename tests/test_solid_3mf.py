"""3MF files as slicers write them: each is made here, and what it prints is known."""

from __future__ import annotations

import json
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fabfold.errors import ModelError
from fabfold.kit.kit import open_kit
from fabfold.solid.load import load_solid, read_mesh
from fabfold.solid.slicer_settings import Painter
from tests.test_solid_dialects import CORNERS, FACES, volume

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
RELATIONS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="r" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def mesh(
    scale: float = 1.0, shift: tuple[float, ...] = (0, 0, 0), more: dict[int, str] | None = None
) -> str:
    """A cube of 20 mm; `more` are attributes of single triangles."""
    points = CORNERS * scale + shift
    rows = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*point) for point in points)
    triangles = "".join(
        '<triangle v1="{}" v2="{}" v3="{}" {}/>'.format(*face, (more or {}).get(index, ""))
        for index, face in enumerate(FACES)
    )
    return f"<mesh><vertices>{rows}</vertices><triangles>{triangles}</triangles></mesh>"


def thing(number: int, inside: str, more: str = "") -> str:
    return f'<object id="{number}" {more}>{inside}</object>'


def write(path: Path, resources: str, build: str, head: str = "", **files: str) -> Path:
    """A package; `files` are further ones, with ``__`` for a stroke and ``_`` for a point."""
    model = (
        f'<model unit="millimeter" xmlns="{CORE}" xmlns:p="{PRODUCTION}" xmlns:m="{MATERIAL}" '
        f'xmlns:s="http://schemas.slic3r.org/3mf/2017/06" {head}>'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr("_rels/.rels", RELATIONS)
        package.writestr("3D/3dmodel.model", model)
        for name, text in files.items():
            package.writestr(name, text)
    return path


ITEM = '<item objectid="{}" {}/>'.format


def test_transforms_and_components(tmp_path: Path) -> None:
    parts = thing(1, mesh()) + thing(
        2,
        '<components><component objectid="1"/>'
        '<component objectid="1" transform="-1 0 0 0 1 0 0 0 1 40 0 0"/></components>',
    )
    path = write(tmp_path / "a.3mf", parts, ITEM(2, 'transform="2 0 0 0 1 0 0 0 1 5 6 7"'))
    solid = load_solid(path)
    assert volume(solid) == pytest.approx(2 * 2 * 8000.0)
    assert solid.vertices.min(axis=0) == pytest.approx([5, 6, 7])
    assert solid.vertices.max(axis=0) == pytest.approx([85, 26, 27])


@pytest.mark.parametrize("word", ['printable="0"', 's:printable="0"', 'printable="false"'])
def test_what_is_not_printed_is_left_out(tmp_path: Path, word: str) -> None:
    parts = thing(1, mesh()) + thing(2, mesh(shift=(50, 0, 0)))
    solid = load_solid(write(tmp_path / "a.3mf", parts, ITEM(1, "") + ITEM(2, word)))
    assert volume(solid) == pytest.approx(8000.0)
    assert "1 object was left out: marked as not to be printed" in solid.notes


@pytest.mark.parametrize("kind", ["support", "solidsupport", "other", "surface"])
def test_helpers_are_no_material(tmp_path: Path, kind: str) -> None:
    parts = thing(1, mesh()) + thing(2, mesh(shift=(50, 0, 0)), f'type="{kind}"')
    solid = load_solid(write(tmp_path / "a.3mf", parts, ITEM(1, "") + ITEM(2, "")))
    assert volume(solid) == pytest.approx(8000.0)
    inside = '<components><component objectid="1"/><component objectid="2"/></components>'
    solid = load_solid(write(tmp_path / "b.3mf", parts + thing(3, inside), ITEM(3, "")))
    assert volume(solid) == pytest.approx(8000.0)


BAMBU = (
    '<config><object id="3"><metadata key="name" value="lid &amp; box"/>'
    '<part id="1" subtype="normal_part"/><part id="2" subtype="{}"/></object></config>'
)
INSIDE = '<components><component objectid="1"/><component objectid="2"/></components>'


@pytest.mark.parametrize(
    ("subtype", "left"),
    [("negative_part", 7000.0), ("modifier_part", 8000.0), ("support_blocker", 8000.0)],
)
def test_parts_of_bambu_studio_and_orcaslicer(tmp_path: Path, subtype: str, left: float) -> None:
    parts = thing(1, mesh()) + thing(2, mesh(0.5, (5, 5, 15))) + thing(3, INSIDE)
    files = {"Metadata/model_settings.config": BAMBU.format(subtype)}
    solid = load_solid(write(tmp_path / "a.3mf", parts, ITEM(3, ""), **files))
    # Half of the hole stands out of the top.
    assert volume(solid) == pytest.approx(left + (500 if left == 7000 else 0))
    assert any("negative part" in note or "left out" in note for note in solid.notes)


@pytest.mark.parametrize(
    ("kind", "left"), [("NegativeVolume", 7500.0), ("ParameterModifier", 8000.0)]
)
def test_volumes_of_prusaslicer(tmp_path: Path, kind: str, left: float) -> None:
    both = mesh().replace("</vertices>", "{}</vertices>").replace("</triangles>", "{}</triangles>")
    points = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*p) for p in CORNERS / 2 + (5, 5, 15))
    more = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*face) for face in FACES + 8)
    config = (
        '<config><object id="1"><metadata type="object" key="name" value="plate"/>'
        '<volume firstid="0" lastid="11"><metadata type="volume" key="volume_type" '
        'value="ModelPart"/></volume><volume firstid="12" lastid="23"><metadata type="volume" '
        f'key="volume_type" value="{kind}"/></volume></object></config>'
    )
    files = {"Metadata/Slic3r_PE_model.config": config}
    path = write(tmp_path / "a.3mf", thing(1, both.format(points, more)), ITEM(1, ""), **files)
    assert volume(load_solid(path)) == pytest.approx(left)


def test_one_of_several_objects_is_chosen(tmp_path: Path) -> None:
    parts = thing(1, mesh(), 'name="lid"') + thing(2, mesh(2, (50, 0, 0)), 'name="box"')
    path = write(tmp_path / "a.3mf", parts, ITEM(1, "") + ITEM(2, ""))
    with pytest.raises(ModelError, match=r"2 objects .* --object NAME .*\(1: lid, 2: box\)"):
        load_solid(path)
    assert volume(load_solid(path, "lid")) == pytest.approx(8000.0)
    assert volume(load_solid(path, "2")) == pytest.approx(64000.0)
    with pytest.raises(ModelError, match="no such object; choose one of 1: lid, 2: box"):
        load_solid(path, "bottom")
    with pytest.raises(ModelError, match="--object chooses in a 3MF file"):
        load_solid(tmp_path.joinpath("x.stl"), "1") if tmp_path.joinpath("x.stl").write_text(
            "solid"
        ) else None


@pytest.mark.slow
def test_the_chosen_object_is_part_of_the_recipe(tmp_path: Path) -> None:
    parts = thing(1, mesh(), 'name="lid"') + thing(2, mesh(2, (50, 0, 0)), 'name="box"')
    path = write(tmp_path / "a.3mf", parts, ITEM(1, "") + ITEM(2, ""))
    lid = open_kit(str(path), folder=tmp_path / "kit", object="lid", template="box-2x2x2")
    lid.run("voxelize")
    again = open_kit(str(tmp_path / "kit"))
    assert again.recipe.object == "lid"
    assert volume(again.solid()) == pytest.approx(8000.0)


def test_a_missing_part_is_named(tmp_path: Path) -> None:
    inside = '<components><component p:path="/3D/Objects/one.model" objectid="1"/></components>'
    head = 'requiredextensions="p"'
    with pytest.raises(ModelError, match=r"3D/Objects/one\.model is missing"):
        load_solid(write(tmp_path / "a.3mf", thing(2, inside), ITEM(2, ""), head))
    other = f'<model xmlns="{CORE}"><resources>{thing(1, mesh())}</resources><build/></model>'
    files = {"3D/Objects/one.model": other}
    path = write(tmp_path / "b.3mf", thing(2, inside), ITEM(2, ""), head, **files)
    assert volume(load_solid(path)) == pytest.approx(8000.0)


def test_an_unknown_extension_is_refused_by_name(tmp_path: Path) -> None:
    address = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
    head = f'xmlns:b="{address}" requiredextensions="b"'
    with pytest.raises(ModelError, match="needs beam lattices"):
        load_solid(write(tmp_path / "a.3mf", thing(1, mesh()), ITEM(1, ""), head))


def test_faults_of_triangles(tmp_path: Path) -> None:
    flat = mesh().replace("<triangles>", '<triangles><triangle v1="0" v2="0" v3="1"/>')
    solid = load_solid(write(tmp_path / "a.3mf", thing(1, flat), ITEM(1, "")))
    assert volume(solid) == pytest.approx(8000.0)
    assert "1 triangle was dropped: two of its corners are one" in solid.notes
    wrong = mesh().replace("<triangles>", '<triangles><triangle v1="0" v2="9" v3="1"/>')
    with pytest.raises(ModelError, match=r"triangle 0 .* object 1 names a vertex"):
        load_solid(write(tmp_path / "b.3mf", thing(1, wrong), ITEM(1, "")))


def nested(levels: int, times: int) -> str:
    rows = [thing(1, mesh())]
    for level in range(2, levels + 1):
        inside = f'<component objectid="{level - 1}"/>' * times
        rows.append(thing(level, f"<components>{inside}</components>"))
    return "".join(rows)


@pytest.mark.parametrize(
    ("levels", "times", "words"),
    [(20, 2, "6,291,456 triangles"), (31, 2, "over 10^10|triangles"), (3000, 2, "over 10\\^")],
)
def test_what_expands_is_refused_before_it_does(
    tmp_path: Path, levels: int, times: int, words: str
) -> None:
    path = write(tmp_path / "bomb.3mf", nested(levels, times), ITEM(levels, ""))
    before = time.process_time()
    with pytest.raises(ModelError, match=words):
        load_solid(path)
    assert time.process_time() - before < 30  # it would take days


def test_deep_and_circular_nesting(tmp_path: Path) -> None:
    path = write(tmp_path / "deep.3mf", nested(3000, 1), ITEM(3000, ""))
    assert volume(load_solid(path)) == pytest.approx(8000.0)
    for loop in ((2, 3, 2), (2, 2, 2)):
        a, b, c = loop
        parts = thing(a, f'<components><component objectid="{b}"/></components>')
        if b != a:
            parts += thing(b, f'<components><component objectid="{c}"/></components>')
        with pytest.raises(ModelError, match="made of itself"):
            load_solid(write(tmp_path / "loop.3mf", parts, ITEM(a, "")))


def test_entities_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.3mf"
    bomb = '<!DOCTYPE x [<!ENTITY a "b"><!ENTITY c "&a;&a;">]><model>&c;</model>'
    with zipfile.ZipFile(path, "w") as package:
        package.writestr("3D/3dmodel.model", bomb)
    with pytest.raises(ModelError, match="entities"):
        load_solid(path)


def test_colours_of_groups_and_of_paint(tmp_path: Path) -> None:
    group = (
        '<m:colorgroup id="7"><m:color color="#FF0000"/><m:color color="#0000FFFF"/></m:colorgroup>'
    )
    one = thing(1, mesh(more={0: 'p1="1"', 1: 'pid="7" p1="1"'}), 'pid="7" pindex="0"')
    shades = read_mesh(write(tmp_path / "a.3mf", group + one, ITEM(1, ""))).colours
    assert shades is not None
    assert shades[:3].tolist() == [[0, 0, 255], [0, 0, 255], [255, 0, 0]]
    settings = json.dumps({"filament_colour": ["#00FF00", "#123456", "#FF8000"]})
    files = {"Metadata/project_settings.config": settings}
    for word in ("paint_color", "s:mmu_segmentation"):
        one = thing(1, mesh(more={0: f'{word}="8"', 3: f'{word}="0C"'}))
        path = write(tmp_path / "b.3mf", one, ITEM(1, ""), **files)
        shades = read_mesh(path).colours
        assert shades is not None
        assert shades[0].tolist() == [0x12, 0x34, 0x56]
        assert shades[3].tolist() == [0xFF, 0x80, 0]
        assert shades[1].tolist() == [0, 0xFF, 0]
        paint = load_solid(path).paint
        assert paint is not None
        assert len(paint.corners) == 2


@pytest.mark.parametrize(
    ("code", "filament"),
    [("4", 1), ("8", 2), ("0C", 3), ("1C", 4), ("DC", 16), ("0FC", 18), ("0", None), ("zz", None)],
)
def test_codes_of_paint(code: str, filament: int | None) -> None:
    painter = Painter([(number, 0, 0) for number in range(1, 30)])
    assert painter.colour(code) == (None if filament is None else (filament, 0, 0))


def test_a_cut_triangle_has_the_colour_of_most_of_it() -> None:
    painter = Painter([(number, 0, 0) for number in range(1, 30)])
    # From its end: cut at three sides, four parts with filaments 2, 2, 2 and 0.
    assert painter.colour("08883") == (2, 0, 0)
    assert painter.colour("00083") is None
    assert painter.colour("83") is None  # cut off


def test_a_damaged_package_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.3mf", thing(1, mesh()), ITEM(1, ""))
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(60):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 4):
            data[at] = int(rng.integers(256))
        path.write_bytes(bytes(data[: int(rng.integers(len(data) // 2, len(data)))]))
        with pytest.raises(ModelError):
            load_solid(path)
    for _ in range(60):
        data = bytearray(whole)
        for at in rng.integers(0, len(data), 4):
            data[at] = int(rng.integers(256))
        path.write_bytes(bytes(data))
        try:
            load_solid(path)
        except ModelError as error:
            assert "a.3mf" in str(error)
