"""Draw the pictures of docs/hinges.md: python docs/draw_hinges.py."""

from __future__ import annotations

import importlib.util
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from build123d import Box, Mode, Plane, Pos
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from fabfold.export.camera import View
from fabfold.export.render import Mesh, render
from fabfold.files import write_bytes
from hinges import (
    Arm,
    Bracket,
    ConePin,
    Coupon,
    Detents,
    DoubleHinge,
    FilamentPin,
    FoldedSheet,
    Leaf,
    LiftPin,
    Magnet,
    MagnetPocket,
    RodPin,
    ScrewPin,
    SingleHinge,
    SnapDimple,
    SnapTongue,
    Stops,
    StraightPin,
)

HOME = Path(__file__).parent / "hinges"
BLUE, ORANGE, GREEN, GREY = (92, 143, 199), (242, 168, 82), (133, 189, 122), (184, 184, 191)
UPRIGHT = View(
    azimuth_deg=-55.0, elevation_deg=35.0, size=(330, 250), samples=2, lights=30, ground=False,
    edges=1.0,
)  # fmt: skip
#: For hinges as they are drawn, their y upwards.
LYING = replace(UPRIGHT, azimuth_deg=-60.0, elevation_deg=28.0)
ALONG = replace(UPRIGHT, azimuth_deg=-90.0, elevation_deg=8.0)
ACROSS = replace(UPRIGHT, azimuth_deg=24.0, elevation_deg=12.0)
#: Turns y up: from the hinge's frame into the picture's.
Y_UP = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])

Color = tuple[int, int, int]
Picture = NDArray[np.uint8]


def halves(hinge: SingleHinge) -> list[Any]:
    """Both halves, and the loose pin if there is one."""
    return [hinge.parent_half, hinge.child_half, *([hinge.hardware] if hinge.hardware else [])]


def cut(shapes: Sequence[Any], plane: Plane = Plane.YZ) -> list[Any]:
    """Cut shapes open by taking away what lies before a plane through the axis."""
    box = plane.location * Pos(0, 0, 50) * Box(200, 200, 100)
    return [shape - box for shape in shapes]


def meshes_of(shapes: Sequence[Any], colors: Sequence[Color]) -> tuple[list[Mesh], list[Color]]:
    """Tessellate shapes, one colour a shape, in turn."""
    meshes, painted = [], []
    for index, shape in enumerate(shapes):
        for solid in shape.solids():
            points, triangles = solid.tessellate(0.02, 0.2)
            vertices = np.array([(point.X, point.Y, point.Z) for point in points])
            meshes.append((vertices, np.array(triangles, dtype=np.int32)))
            painted.append(colors[index % len(colors)])
    return meshes, painted


def picture(
    shapes: Sequence[Any],
    view: View = LYING,
    colors: Sequence[Color] = (BLUE, ORANGE, GREY),
    *,
    y_up: bool = True,
) -> Picture:
    """Draw shapes, with y up or with z up."""
    meshes, painted = meshes_of(shapes, colors)
    if y_up:
        meshes = [(vertices @ Y_UP.T, faces) for vertices, faces in meshes]
    return render(meshes, np.array(painted, dtype=np.uint8), None, view)


def save(image: Image.Image, path: Path) -> None:
    """Write a PNG of 128 colours, so that a picture stays small."""
    stream = io.BytesIO()
    image.quantize(128, dither=Image.Dither.NONE).save(stream, "PNG", optimize=True)
    write_bytes(path, stream.getvalue())
    print(path.name, path.stat().st_size // 1024, "kB")


def page(name: str, rows: Sequence[tuple[str, Picture]], columns: int = 3) -> None:
    """Save pictures of one size as one, each with its caption below."""
    high, wide, _ = rows[0][1].shape
    band = 26
    lines = -(-len(rows) // columns)
    whole = Image.new("RGB", (wide * min(columns, len(rows)), (high + band) * lines), "white")
    pen, font = ImageDraw.Draw(whole), ImageFont.load_default(15)
    for index, (caption, image) in enumerate(rows):
        x, y = wide * (index % columns), (high + band) * (index // columns)
        whole.paste(Image.fromarray(image), (x, y))
        pen.text((x + wide // 2, y + high + band // 2), caption, "black", font=font, anchor="mm")
    save(whole, HOME / name)


def single_pictures() -> None:
    """Every parameter of the single hinge and its leaves."""
    base = {"clearance": 0.3, "angle": 60.0}
    page(
        "single.png",
        [
            ("SingleHinge(20)", picture(halves(SingleHinge(20, **base)))),
            ("parent_half", picture([SingleHinge(20, **base).parent_half])),
            ("parent_carve", picture([SingleHinge(20, **base).parent_carve])),
            ("knuckles=2, StraightPin", picture(halves(_straight(2)))),
            ("knuckles=5", picture(halves(SingleHinge(30, knuckles=5, **base)))),
            ("radius=4", picture(halves(SingleHinge(30, radius=4, **base)))),
            ("chamfer=0.4", picture(halves(SingleHinge(20, chamfer=0.4, **base)))),
            ("gap=1.5", picture(halves(SingleHinge(20, clearance=0.3, gap=1.5)))),
            ("margin=0", picture(halves(SingleHinge(20, margin=0.0, **base)))),
        ],
    )
    leaf = {"clearance": 0.3, "angle": 60.0}
    page(
        "leaves.png",
        [
            ("Bracket(9, 5)", picture(halves(SingleHinge(30, leaf=Bracket(9, 5), **leaf)))),
            (
                "Bracket(gusset=True)",
                picture(halves(SingleHinge(30, leaf=Bracket(gusset=True), **leaf))),
            ),
            (
                "Bracket(flat=True)",
                picture(
                    halves(SingleHinge(30, clearance=0.3, leaf=Bracket(flat=True))),
                    replace(LYING, elevation_deg=-28.0),
                ),
            ),
            ("Leaf(14, 2)", picture(halves(SingleHinge(40, leaf=Leaf(14, 2), **leaf)))),
            (
                "Leaf(..., holes=3, sink=6)",
                picture(halves(SingleHinge(40, leaf=Leaf(14, 2, holes=3, sink=6), **leaf))),
            ),
            (
                "Leaf(..., flat=True)",
                picture(
                    halves(SingleHinge(40, radius=3, clearance=0.3, leaf=Leaf(14, 1.9, flat=True))),
                    replace(LYING, elevation_deg=-28.0),
                ),
            ),
            (
                "Leaf(14, 2, offset=0.15)",
                picture(halves(SingleHinge(40, leaf=Leaf(14, 2, offset=0.15), **leaf))),
            ),
        ],
    )
    page(
        "angles.png",
        [
            (f"angle={angle}", picture(halves(SingleHinge(30, clearance=0.3, angle=angle)), ALONG))
            for angle in (0, 90, 180)
        ],
    )


def _straight(knuckles: int) -> SingleHinge:
    return SingleHinge(
        20, knuckles=knuckles, clearance=0.3, angle=60.0, pin=StraightPin(0.8), radius=2.8
    )


def arm_pictures() -> None:
    """Arms, a box with a lower lid, and a lid that opens by 270°."""

    def draw(leaf: Any, **options: Any) -> Picture:
        hinge = SingleHinge(30, clearance=0.3, leaf=leaf, **options)
        return picture(_on_blocks(hinge), ALONG)

    flat = {"angle": 90.0, "clear_top": True}
    uneven = (Arm(offset=7, clear_top=True), Arm(height=6))
    page(
        "arms.png",
        [
            ("Arm()", draw(Arm())),
            ("Arm(offset=7, fill=False)", draw(Arm(offset=7, fill=False))),
            ("Arm(angle=90, clear_top=True)", draw(Arm(**flat))),
            (
                "round_top=1, round_bottom=4",
                draw(Arm(offset=7, fill=False, round_top=1, round_bottom=4)),
            ),
            ("Arm(clip=4)", draw(Arm(clip=4))),
            ("Arm(offset=2, root=3, angle=90, ...)", draw(Arm(offset=2, root=3, **flat))),
            ("Arm.pair(14)", draw(Arm.pair(14))),
            ("Arm.pair(14, fill=False, angle=60)", draw(Arm.pair(14, fill=False, angle=60))),
            (
                "(Arm(offset=7, ...), Arm(height=6))",
                draw(uneven),
            ),
        ],
    )
    hinge = SingleHinge(60, knuckles=5, clearance=0.3, leaf=Arm.pair(26))
    box, lid = hinge.fit(*_cases(hinge, 36, 10), check=False)
    rows = []
    view = replace(LYING, azimuth_deg=-60.0, elevation_deg=25.0)
    for angle, words in ((0, "as printed"), (110, "at 110°"), (180, "closed")):
        box.joints["hinge"].connect_to(lid.joints["hinge"], angle=angle)
        rows.append((f"Arm.pair(26): {words}", picture([box, lid], view)))
    hinge = SingleHinge(
        60, clearance=0.3, leaf=(Arm(offset=4, **flat), Arm(**flat)), opens=270, closed=180
    )
    box, lid = hinge.fit(*_cases(hinge, 36, 3, wall=3), check=False)
    for angle in (180, 0, -90):
        box.joints["hinge"].connect_to(lid.joints["hinge"], angle=angle)
        rows.append((f"opens=270, closed=180: at {angle}°", picture([box, lid], view)))
    page("unequal.png", rows)


def _on_blocks(hinge: SingleHinge) -> list[Any]:
    """Both halves and the near ends of the bodies that they stand on."""
    (aside, below), (other, other_below) = hinge.corners
    made = hinge.fit(
        Pos(-aside - 6, -below - 12) * Box(12, 24, 30),
        Pos(other + 6, -other_below - 12) * Box(12, 24, 30),
        check=False,
    )
    return list(made)


def _cases(hinge: SingleHinge, box_high: float, lid_high: float, wall: float = 2.0) -> list[Any]:
    """A box and a lid, hollow from above, where the arms of a hinge reach."""
    made = []
    for (aside, below), high, side in zip(
        hinge.corners, (box_high, lid_high), (-1, 1), strict=True
    ):
        case = Pos(0, -high / 2) * Box(40, high, 60)
        if high > wall:
            case -= Pos(0, -high / 2 + wall) * Box(40 - 2 * wall, high, 60 - 2 * wall)
        made.append(Pos(side * (aside + 20), -below) * case)
    return made


def pin_pictures() -> None:
    """Every pin, cut open, and the bores."""
    rows = []
    for text, options in (
        ("ConePin(1.5)", {"pin": ConePin(1.5), "radius": 2.5}),
        ("StraightPin(0.8)", {"pin": StraightPin(0.8), "radius": 2.8, "knuckles": 2}),
        ("FilamentPin(1.75)", {"pin": FilamentPin()}),
        ("FilamentPin(heads=True)", {"pin": FilamentPin(heads=True), "radius": 2.6}),
        ("ScrewPin('M2', end='nut')", {"pin": ScrewPin("M2", end="nut")}),
        ("ScrewPin('M3', end='tap')", {"pin": ScrewPin("M3"), "length": 24}),
        (
            "ScrewPin('M3', sunk=True, end='nut')",
            {"pin": ScrewPin("M3", sunk=True, end="nut"), "length": 36},
        ),
        (
            "head='countersunk'",
            {"pin": ScrewPin("M2", head="countersunk", sunk=True), "length": 24},
        ),
        ("RodPin(2.0)", {"pin": RodPin(2.0)}),
    ):
        hinge = SingleHinge(**{"length": 20, "clearance": 0.3, **options})
        rows.append((text, picture(cut(halves(hinge)), ACROSS)))
    page("pins.png", rows)
    hinge = SingleHinge(24, knuckles=2, clearance=0.3, pin=LiftPin(1.5, at=90), angle=90)
    near = replace(LYING, azimuth_deg=30.0, elevation_deg=40.0)
    off = hinge.child_half.moved(Pos(0, 0, 14))
    page(
        "lift.png",
        [
            ("LiftPin(1.5, at=90), cut open", picture(cut(halves(hinge)), ACROSS)),
            ("the tooth on the pin", picture([hinge.parent_half], near, y_up=False)),
            ("lifted off at 90°", picture([hinge.parent_half, off], near, y_up=False)),
        ],
    )
    rows = []
    for bore in ("round", "teardrop", "octagon"):
        hinge = SingleHinge(24, clearance=0.3, pin=ScrewPin("M3"), bore=bore)
        rows.append((f"bore={bore!r}", picture([hinge.child_half], ALONG)))
    page("bores.png", rows)


def stop_pictures() -> None:
    """Stops and detents."""
    options = {"clearance": 0.3, "leaf": Bracket(6, 6), "angular_range": (0, 110)}
    rows = [
        (f"stops=True, at {angle}°", picture(halves(hinge), ALONG))
        for angle, hinge in (
            (0, SingleHinge(30, stops=True, **options)),
            (103, SingleHinge(30, stops=True, angle=103, **options)),
        )
    ]
    both = SingleHinge(
        30,
        clearance=0.3,
        leaf=Bracket(6, 6),
        stops=Stops(lower=True, upper=True),
        angular_range=(45, 135),
        angle=90,
    )
    rows.append(("lower and upper, 45° to 135°", picture(halves(both), ALONG)))
    clicks = SingleHinge(
        30, clearance=0.3, radius=3.4, pin=ConePin(1.5), detents=Detents((0.0, 90.0, 180.0))
    )
    rows += [
        (
            "detents: the bump",
            picture(
                [_end(clicks.parent_half, -3.5)],
                replace(UPRIGHT, azimuth_deg=-70.0, elevation_deg=40.0),
                y_up=False,
            ),
        ),
        (
            "detents: dimples and tracks",
            picture(
                [clicks.child_half],
                replace(UPRIGHT, azimuth_deg=60.0, elevation_deg=-40.0),
                y_up=False,
            ),
        ),
    ]
    page("stops.png", rows)


def folded_pictures() -> None:
    """A tray, flat, on its way and folded; and its snaps."""
    sheet = FoldedSheet.tray(60, 50, 25, use="few")
    view = replace(UPRIGHT, azimuth_deg=-60.0, elevation_deg=45.0)
    rows = [("FoldedSheet.tray(60, 50, 25).flat", picture([sheet.flat], view, y_up=False))]
    for share in (0.5, 1.0):
        panels, webs = sheet.bent(share)
        colors = [BLUE if index == sheet.base else ORANGE for index in range(len(panels))]
        painted = (*colors, *[GREY] * len(webs))
        drawn = picture([*panels, *webs], view, painted, y_up=False)
        rows.append((f"bent({share:g})", drawn))
    fold = FoldedSheet(Pos(0, 0, 1) * Box(36, 24, 2), [((0, -12), (0, 12))], use="few")
    near = replace(UPRIGHT, azimuth_deg=-125.0, elevation_deg=32.0)
    for share, words in ((0.0, "lock and sockets"), (0.8, "before they meet"), (1.0, "held")):
        panels, webs = fold.bent(share)
        rows.append((words, picture([*panels, *webs], near, y_up=False)))
    page("folded.png", rows)


def _end(shape: Any, level: float) -> Any:
    """Keep what lies below a level of z."""
    return shape - Pos(0, 0, level + 50) * Box(200, 200, 100)


def double_pictures() -> None:
    """Every parameter of the double hinge."""

    def draw(**options: Any) -> Picture:
        hinge = DoubleHinge(**{"size": 20, "clearance": 0.3, **options})
        return picture(hinge.solids(), colors=(BLUE, GREEN, ORANGE))

    page(
        "double.png",
        [
            ("DoubleHinge(20), closed", draw()),
            ("angles=(60, 60)", draw(angles=(60, 60))),
            ("angles=(180, 90)", draw(angles=(180, 90))),
            ("second='+z'", draw(second="+z", angles=(60, 60))),
            ("second='+y' (one edge)", draw(size=30, second="+y", angles=(60, 60))),
            ("turns=(270, 180)", draw(turns=(270, 180), angles=(225, 0))),
            ("plate=1.2", draw(plate=1.2, angles=(60, 60))),
            ("knuckles=5", draw(size=30, knuckles=5, angles=(60, 60))),
            ("pin=FilamentPin()", draw(size=24, pin=FilamentPin(), angles=(60, 60))),
        ],
    )
    hinge = DoubleHinge(20, clearance=0.3)
    side = 19.7
    boxes = [Pos(x, 0, 0) * Box(side, side, side) for x in (-10, 10)]
    parent, link, child = hinge.fit(*boxes)
    rows = [
        ("parent_carve", picture([hinge.parent_carve])),
        ("parent's box", picture([parent], replace(LYING, azimuth_deg=40.0))),
    ]
    parent.joints["link"].connect_to(link.joints["parent"], angle=120)
    link.joints["child"].connect_to(child.joints["link"], angle=60)
    colors = (BLUE, GREEN, ORANGE)
    rows.append(("fit(box, box)", picture([parent, link, child], colors=colors)))
    page("double_fit.png", rows)


def other_pictures() -> None:
    """Magnets, snap tongues and the coupon."""
    block = Pos(0, 0, -4) * Box(14, 14, 8)
    closed = MagnetPocket(Magnet(6, 3), "captured", mode=Mode.PRIVATE)
    round_ = MagnetPocket(Magnet(6, 3), mode=Mode.PRIVATE)
    square = MagnetPocket(Magnet(6, 3, "square"), mode=Mode.PRIVATE)
    tongue, dimple = SnapTongue(mode=Mode.PRIVATE), SnapDimple(mode=Mode.PRIVATE)
    mate = Pos(0, 0, 5.3) * Box(10, 10, 10) - dimple
    base = Pos(0, 0, -2) * Box(10, 10, 4)
    whole = [base + tongue, mate]
    page(
        "retention.png",
        [
            ("MagnetPocket, press fit", picture([block - round_], y_up=False)),
            ("square", picture([block - square], y_up=False)),
            (
                "captured by a pause (cut open)",
                picture(cut([block - closed, closed.magnet_part], Plane.XZ), y_up=False),
            ),
            ("SnapTongue", picture([base + tongue], y_up=False)),
            ("SnapDimple (cut open)", picture(cut([mate], Plane.XZ), y_up=False)),
            (
                "closed (cut open)",
                picture(cut(whole, Plane.XZ), replace(ALONG, elevation_deg=10.0), y_up=False),
            ),
        ],
    )
    coupon = Coupon()
    view = replace(UPRIGHT, azimuth_deg=-75.0, elevation_deg=48.0, size=(960, 420))
    colors = [(BLUE, ORANGE, GREEN)[(index - 1) % 3] if index else GREY for index in range(25)]
    meshes = [(mesh.vertices, mesh.faces) for mesh in coupon.meshes]
    drawn = render(meshes, np.array(colors, dtype=np.uint8), None, view)
    save(Image.fromarray(drawn), HOME / "coupon.png")


def example_pictures() -> None:
    """The examples."""
    folder = Path(__file__).parents[1] / "examples"

    def load(name: str) -> Any:
        spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    box, lid = load("07_lidded_box_build123d").main()
    rows = [("07: as printed", picture([box, lid], UPRIGHT, y_up=False))]
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=120)
    rows.append(("07: half closed", picture([box, lid], UPRIGHT, y_up=False)))
    base, back, link, lip = load("09_phone_stand_build123d").main()
    base.joints["back"].connect_to(back.joints["back"], angle=103)
    base.joints["link"].connect_to(link.joints["parent"], angle=180)
    link.joints["child"].connect_to(lip.joints["link"], angle=0)
    in_use = [base, back, link, lip]
    view = replace(UPRIGHT, azimuth_deg=-30.0, elevation_deg=20.0)
    colors = (BLUE, ORANGE, GREEN, GREY)
    rows.append(("09: in use", picture(in_use, view, colors, y_up=False)))
    page("examples.png", rows)


def main() -> None:
    """Draw all of them."""
    single_pictures()
    arm_pictures()
    pin_pictures()
    stop_pictures()
    double_pictures()
    folded_pictures()
    other_pictures()
    example_pictures()


if __name__ == "__main__":
    main()
