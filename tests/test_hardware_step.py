"""STEP with pins, screws and magnets as parts of their own: exact, named, coloured, in place."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from build123d import import_step
from export_kits import row_joinery, row_tree

from fabfold.export.hardware_brep import hardware_solids, turned_brep
from fabfold.export.step import write_step
from fabfold.export.steptext import StepSolid, step_text
from fabfold.joinery.bodies import PlacedPin
from fabfold.joinery.box_hold import Retention
from fabfold.joinery.magnets import MagnetPair

PAIR = MagnetPair((0, 3), ((20.0, 5.0, 7.0), (80.0, 5.0, 7.0)), ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def assembled(tmp_path_factory):
    """The row with a pin, a rod, a screw and two magnets."""
    tree, joinery = row_tree(), row_joinery(row_tree(), bump=False)
    pins = (
        PlacedPin(0, 0, (22.5, 3.0, 15.0), (22.5, 3.0, 3.0), 1.75),
        PlacedPin(1, 1, (40.0, -14.0, 20.0), (40.0, 0.0, 20.0), 2.0),
        PlacedPin(2, 2, (62.5, 3.0, 16.0), (62.5, 3.0, 6.0), 2.0, 1.9, 2.0, 2.5),
    )
    joinery = replace(joinery, pins=pins)
    hardware = hardware_solids(joinery, tree, Retention((), (), "3x1", pairs=(PAIR,)))
    folder = tmp_path_factory.mktemp("assembled")
    path, both = folder / "row.step", folder / "hardware" / "row-assembled.step"
    write_step(path, joinery, tree, hardware=hardware, assembled=both)
    return joinery, hardware, path, both


NAMES = ["pin-00", "pin-01", "screw-02", "magnet-00-north-out", "magnet-00-south-out"]


@pytest.mark.slow
def test_bodies_alone_are_in_the_one_file_and_all_parts_in_the_other(assembled):
    joinery, _, path, both = assembled
    bodies = [body.name for body in joinery.bodies]
    assert [child.label for child in import_step(path).children] == bodies
    parts = import_step(both).children
    assert [child.label for child in parts] == [*bodies, *NAMES]
    assert all(solid.is_valid for child in parts for solid in child.solids())
    assert all(len(child.solids()) == 1 for child in parts)


def test_names_are_the_same_for_product_and_occurrence(assembled):
    text = assembled[3].read_text(encoding="ascii")
    products = re.findall(r"=PRODUCT\('([^']*)'", text)
    uses = re.findall(r"NEXT_ASSEMBLY_USAGE_OCCURRENCE\('\d+','([^']*)'", text)
    assert products[0] == "row assembled"
    assert products[1:] == uses
    assert uses[-5:] == NAMES


def test_hardware_is_exact_and_where_it_goes(assembled):
    joinery, _, _, both = assembled
    parts = {child.label: child for child in import_step(both).children}
    for name, pin in zip(NAMES[:3], joinery.pins, strict=True):
        part = parts[name]
        radius = pin.diameter_mm / 2
        volume = np.pi * (radius**2 * pin.length_mm + pin.head_mm**2 * pin.head_height_mm)
        assert part.volume == pytest.approx(volume, rel=1e-9)
        round_faces = [face for face in part.faces() if face.geom_type.name == "CYLINDER"]
        wanted = {radius} | ({pin.head_mm} if pin.head_mm else set())
        assert {round(face.radius, 6) for face in round_faces} == wanted
        out = np.subtract(pin.tail_mm, pin.tip_mm) / pin.length_mm
        ends = np.array([pin.tip_mm, np.array(pin.tail_mm) + pin.head_height_mm * out])
        wide = max(radius, pin.head_mm) * (1 - np.abs(out))
        box = part.bounding_box()
        assert tuple(box.min) == pytest.approx(ends.min(axis=0) - wide, abs=1e-4)
        assert tuple(box.max) == pytest.approx(ends.max(axis=0) + wide, abs=1e-4)
    for name, mouth, inward in zip(NAMES[3:], PAIR.points_mm, PAIR.inwards, strict=True):
        part = parts[name]
        assert part.volume == pytest.approx(np.pi * 1.5**2 * 1.0, rel=1e-9)
        middle = np.array(mouth) + 0.7 * np.array(inward)  # 0.2 below the mouth, 1 thick
        assert tuple(part.center()) == pytest.approx(middle, abs=1e-6)


def test_filament_steel_and_magnets_have_colours_of_their_own(assembled):
    colours = {solid.name: solid.colour for solid in assembled[1]}
    assert len({colours[name] for name in ("pin-00", "pin-01", "magnet-00-north-out")}) == 3
    assert colours["pin-01"] == colours["screw-02"]


@pytest.mark.parametrize("direction", [0, 1, 2])
@pytest.mark.parametrize(
    "sections",
    [[(1.0, 0.0, 5.0)], [(1.0, -3.0, 5.0), (2.0, 5.0, 6.0)], [(2.0, 0.0, 1.0), (0.5, 1.0, 4.0)]],
)
def test_turned_solids_are_valid_along_every_axis(direction, sections, tmp_path):
    solid = StepSolid("one", turned_brep((1.0, 2.0, 3.0), direction, sections), (9, 9, 9))
    path = tmp_path / "one.step"
    path.write_text(step_text([solid], "one", "test"), encoding="ascii")
    (read,) = import_step(path).solids()
    assert read.is_valid
    volume = sum(np.pi * radius**2 * (end - start) for radius, start, end in sections)
    assert read.volume == pytest.approx(volume, rel=1e-9)


def test_without_hardware_there_is_no_second_file(tmp_path):
    tree, joinery = row_tree(), row_joinery(row_tree(), bump=False)
    both = tmp_path / "hardware" / "row-assembled.step"
    both.parent.mkdir()
    both.write_text("of an older export")
    write_step(tmp_path / "row.step", joinery, tree, assembled=both)
    assert not both.exists()
