"""The text of a STEP file (ISO 10303-21, AP214): named, coloured solids in one assembly.

Written without a CAD kernel: shared vertices and edges stay shared, the header holds no clock and
no author, and the same solids give the same bytes. The entities of a solid are numbered from where
those of the solid before end, so the same lines do for a file of it alone and for one of all.

References
----------
ISO 10303-42 (geometry and topology), ISO 10303-44 (product structure), ISO 10303-46 (colours).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fabfold.export.body_brep import Brep, BrepEdge, Face
from fabfold.export.surfaces import Axis, Plane

__all__ = ["FIRST_NUMBER", "StepPart", "StepSolid", "step_file", "step_part", "step_text"]

#: Points nearer than this count as one; readers take it as the model's precision, mm.
UNCERTAINTY_MM = 1e-3
#: Number of the first entity of a file's first solid; the smaller ones belong to the file itself.
FIRST_NUMBER = 101


class StepSolid(NamedTuple):
    """A solid of the file.

    Attributes
    ----------
    name : str
        Name of the solid.
    brep : Brep
        Its boundary, mm.
    colour : (int, int, int)
        Its colour, sRGB bytes.
    """

    name: str
    brep: Brep
    colour: tuple[int, int, int]


class StepPart(NamedTuple):
    """A solid as the lines of a file.

    Attributes
    ----------
    name : str
        Name of the solid.
    colour : (int, int, int)
        Its colour, sRGB bytes.
    lines : tuple of str
        Its entities.
    number : int
        The entity that is the solid.
    following : int
        The first number that is free after it.
    """

    name: str
    colour: tuple[int, int, int]
    lines: tuple[str, ...]
    number: int
    following: int


class _Writer:
    """Numbers entities and joins equal ones."""

    def __init__(self, first: int) -> None:
        self.lines: list[str] = []
        self.following = first
        self._known: dict[str, int] = {}

    def add(self, text: str) -> int:
        number = self.following
        self.lines.append(f"#{number}={text};")
        self.following = number + 1
        return number

    def once(self, text: str) -> int:
        if text not in self._known:
            self._known[text] = self.add(text)
        return self._known[text]

    def point(self, xyz: Sequence[float]) -> int:
        return self.once(f"CARTESIAN_POINT('',{_triple(xyz)})")

    def direction(self, xyz: Sequence[float]) -> int:
        return self.once(f"DIRECTION('',{_triple(xyz)})")

    def frame(self, point: Sequence[float], z: Sequence[float], x: Sequence[float]) -> int:
        return self.once(
            f"AXIS2_PLACEMENT_3D('',#{self.point(point)},#{self.direction(z)},#{self.direction(x)})"
        )


def _real(value: float) -> str:
    text = f"{value:.9f}".rstrip("0")
    return "0." if text == "-0." else text


def _triple(values: Sequence[float]) -> str:
    x, y, z = values
    return f"({_real(x)},{_real(y)},{_real(z)})"


def _string(text: str) -> str:
    """A quoted string; anything but plain ASCII as ISO 10303-21 wants it.

    A quote before a comma or bracket is written by its number: Open CASCADE takes it for the end
    of the string even where it is doubled.
    """
    parts = []
    for index, letter in enumerate(text):
        if letter == "'" and text[index + 1 :].lstrip()[:1] in (",", ")", ""):
            parts.append("\\X\\27")
        elif letter in "'\\":
            parts.append(letter * 2)
        elif " " <= letter <= "~":
            parts.append(letter)
        else:
            parts.append("\\X4\\" + f"{ord(letter):08X}" + "\\X0\\")
    return "'" + "".join(parts) + "'"


def _refs(numbers: Sequence[int]) -> str:
    return "(" + ",".join(f"#{number}" for number in numbers) + ")"


def _square_to(normal: Sequence[float]) -> tuple[float, float, float]:
    """Some unit vector square to `normal`, along a lattice axis where that can be."""
    a, b, c = (float(value) for value in normal)
    least = min(range(3), key=lambda axis: abs((a, b, c)[axis]))
    x, y, z = ((0.0, c, -b), (-c, 0.0, a), (b, -a, 0.0))[least]
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)


def _axes_of(axis: Axis) -> tuple[list[float], list[float]]:
    """Direction of an axis and the direction from which angles about it count."""
    unit = np.eye(3)
    return unit[axis.direction].tolist(), unit[(axis.direction + 1) % 3].tolist()


def _edge(
    writer: _Writer,
    points: list[list[float]],
    edge: BrepEdge,
    point: dict[int, int],
    vertex: dict[int, int],
) -> int:
    if edge.axis is None:
        x, y, z = points[edge.start]
        to_x, to_y, to_z = points[edge.end]
        length = math.dist((x, y, z), (to_x, to_y, to_z))
        if not length > 0.0:
            raise ValueError("an edge of length zero")
        along = ((to_x - x) / length, (to_y - y) / length, (to_z - z) / length)
        vector = writer.add(f"VECTOR('',#{writer.direction(along)},1.)")
        curve = writer.add(f"LINE('',#{point[edge.start]},#{vector})")
    else:
        upwards, sideways = _axes_of(edge.axis)
        centre = np.asarray(edge.axis.point) + edge.height * np.asarray(upwards)
        frame = writer.frame(centre.tolist(), upwards, sideways)
        curve = writer.add(f"CIRCLE('',#{frame},{_real(edge.radius)})")
    return writer.add(f"EDGE_CURVE('',#{vertex[edge.start]},#{vertex[edge.end]},#{curve},.T.)")


def _surface(writer: _Writer, brep: Brep, face: Face) -> tuple[int, str]:
    surface = face.surface
    if isinstance(surface, Plane):
        frame = writer.frame(surface.point, surface.normal, _square_to(surface.normal))
        return writer.add(f"PLANE('',#{frame})"), ".T."
    z, x = _axes_of(surface.axis)
    sense = ".T." if surface.outward else ".F."
    if surface.slope == 0.0:
        frame = writer.frame(surface.axis.point, z, x)
        return writer.add(f"CYLINDRICAL_SURFACE('',#{frame},{_real(surface.radius)})"), sense
    # A cone's frame sits at the wide end of the face, where its radius is not zero.
    used = [brep.edges[index].start for loop in face.loops for index, _ in loop]
    used += [brep.edges[index].end for loop in face.loops for index, _ in loop]
    heights = (brep.vertices[used] - np.asarray(surface.axis.point)) @ np.asarray(z)
    height = float(heights.max() if surface.slope > 0 else heights.min())
    centre = np.asarray(surface.axis.point) + height * np.asarray(z)
    towards = z if surface.slope > 0 else [-value for value in z]
    frame = writer.frame(centre.tolist(), towards, x)
    radius = surface.radius + surface.slope * height
    angle = math.atan(abs(surface.slope))
    return writer.add(f"CONICAL_SURFACE('',#{frame},{_real(radius)},{_real(angle)})"), sense


def step_part(solid: StepSolid, first: int = FIRST_NUMBER) -> StepPart:
    """The lines of a solid.

    Parameters
    ----------
    solid : StepSolid
        The solid.
    first : int
        Number of its first entity: `StepPart.following` of the solid before it in a file.

    Returns
    -------
    StepPart
        For :func:`step_file`.

    Raises
    ------
    ValueError
        If an edge has no length.
    """
    writer, brep = _Writer(first), solid.brep
    point: dict[int, int] = {}
    vertex: dict[int, int] = {}
    points = brep.vertices.tolist()  # Plain numbers: an array of three costs more than it holds.
    for edge in brep.edges:
        for index in (edge.start, edge.end):
            if index not in vertex:
                point[index] = writer.point(points[index])
                vertex[index] = writer.add(f"VERTEX_POINT('',#{point[index]})")
    edges = [_edge(writer, points, edge, point, vertex) for edge in brep.edges]
    faces = []
    for face in brep.faces:
        bounds = []
        for position, loop in enumerate(face.loops):
            oriented = [
                writer.add(f"ORIENTED_EDGE('',*,*,#{edges[index]},{'.T.' if along else '.F.'})")
                for index, along in loop
            ]
            ring = writer.add(f"EDGE_LOOP('',{_refs(oriented)})")
            kind = "FACE_OUTER_BOUND" if position == 0 else "FACE_BOUND"
            bounds.append(writer.add(f"{kind}('',#{ring},.T.)"))
        surface, sense = _surface(writer, brep, face)
        faces.append(writer.add(f"ADVANCED_FACE('',{_refs(bounds)},#{surface},{sense})"))
    shell = writer.add(f"CLOSED_SHELL('',{_refs(faces)})")
    number = writer.add(f"MANIFOLD_SOLID_BREP({_string(solid.name)},#{shell})")
    return StepPart(solid.name, solid.colour, tuple(writer.lines), number, writer.following)


def _product(writer: _Writer, name: str, contexts: tuple[int, int]) -> tuple[int, int]:
    """Product definition and its shape."""
    product_context, definition_context = contexts
    quoted = _string(name)
    product = writer.add(f"PRODUCT({quoted},{quoted},'',(#{product_context}))")
    writer.add(f"PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))")
    formation = writer.add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
    definition = writer.add(f"PRODUCT_DEFINITION('design','',#{formation},#{definition_context})")
    return definition, writer.add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")


def _styled(writer: _Writer, solid: int, colour: tuple[int, int, int]) -> int:
    red, green, blue = (_real(round(value / 255.0, 6)) for value in colour)
    paint = writer.once(f"COLOUR_RGB('',{red},{green},{blue})")
    fill = writer.once(f"FILL_AREA_STYLE_COLOUR('',#{paint})")
    area = writer.once(f"FILL_AREA_STYLE('',(#{fill}))")
    style = writer.once(f"SURFACE_STYLE_FILL_AREA(#{area})")
    side = writer.once(f"SURFACE_SIDE_STYLE('',(#{style}))")
    usage = writer.once(f"SURFACE_STYLE_USAGE(.BOTH.,#{side})")
    assignment = writer.once(f"PRESENTATION_STYLE_ASSIGNMENT((#{usage}))")
    return writer.add(f"STYLED_ITEM('color',(#{assignment}),#{solid})")


def step_text(solids: Sequence[StepSolid], title: str, application: str) -> str:
    """The whole file of some solids, as :func:`step_file` makes it of their parts."""
    parts: list[StepPart] = []
    for solid in solids:
        parts.append(step_part(solid, parts[-1].following if parts else FIRST_NUMBER))
    return step_file(parts, title, application)


def step_file(parts: Sequence[StepPart], title: str, application: str) -> str:
    """The whole file.

    Parameters
    ----------
    parts : sequence of StepPart
        The solids, no two with a number in common; each becomes a part of the assembly `title`, in
        its place.
    title : str
        Name of the assembly.
    application : str
        Name and version of the program, for the header.

    Returns
    -------
    str
        The content of the file, ASCII.
    """
    writer = _Writer(1)
    application_context = writer.add(
        "APPLICATION_CONTEXT('core data for automotive mechanical design processes')"
    )
    writer.add(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,"
        f"#{application_context})"
    )
    contexts = (
        writer.add(f"PRODUCT_CONTEXT('',#{application_context},'mechanical')"),
        writer.add(
            f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application_context},'design')"
        ),
    )
    length = writer.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = writer.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = writer.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    precision = writer.add(
        f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({UNCERTAINTY_MM:.1E}),#{length},"
        "'distance_accuracy_value','largest distance between points that count as one')"
    )
    context = writer.add(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)"
        f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{precision}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid_angle}))"
        "REPRESENTATION_CONTEXT('mm','3D'))"
    )
    here = writer.frame((0, 0, 0), (0, 0, 1), (1, 0, 0))
    whole, whole_shape = _product(writer, title, contexts)
    whole_representation = writer.add(
        f"SHAPE_REPRESENTATION({_string(title)},(#{here}),#{context})"
    )
    writer.add(f"SHAPE_DEFINITION_REPRESENTATION(#{whole_shape},#{whole_representation})")
    head, writer.lines = writer.lines, []
    assert writer.following <= FIRST_NUMBER
    writer.following = max((part.following for part in parts), default=FIRST_NUMBER)
    styled = []
    for number, part in enumerate(parts, start=1):
        name = part.name
        styled.append(_styled(writer, part.number, part.colour))
        definition, shape = _product(writer, name, contexts)
        representation = writer.add(
            f"ADVANCED_BREP_SHAPE_REPRESENTATION({_string(name)},(#{here},#{part.number}),"
            f"#{context})"
        )
        writer.add(f"SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})")
        usage = writer.add(
            f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}',{_string(name)},'',#{whole},"
            f"#{definition},$)"
        )
        placed = writer.add(
            f"PRODUCT_DEFINITION_SHAPE('Placement','Placement of an item',#{usage})"
        )
        stay = writer.add(f"ITEM_DEFINED_TRANSFORMATION('','',#{here},#{here})")
        relation = writer.add(
            f"(REPRESENTATION_RELATIONSHIP('','',#{representation},#{whole_representation})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{stay})"
            "SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        writer.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{placed})")
    writer.add(
        f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{_refs(styled)},#{context})"
    )
    data = [*head, *(line for part in parts for line in part.lines), *writer.lines]
    header = [
        "ISO-10303-21;",
        "HEADER;",
        f"FILE_DESCRIPTION(({_string(title)}),'2;1');",
        f"FILE_NAME({_string(title)},'1970-01-01T00:00:00',(''),(''),"
        f"{_string(application)},{_string(application)},'');",
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));",
        "ENDSEC;",
        "DATA;",
    ]
    return "\n".join([*header, *data, "ENDSEC;", "END-ISO-10303-21;", ""])
