"""Draw the pictures of docs/hinges.md: python docs/draw_hinges.py."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from build123d import Box, Mode, Plane, Pos

from hinges import (
    Bracket,
    ConePin,
    Coupon,
    Detents,
    DoubleHinge,
    FilamentPin,
    Leaf,
    Magnet,
    MagnetPocket,
    RodPin,
    ScrewPin,
    SingleHinge,
    SnapDimple,
    SnapSpec,
    SnapTongue,
    Stops,
    StraightPin,
)
from hinges.picture import PALETTE, Body, Camera, bodies_of, render, save, sheet

HOME = Path(__file__).parent / "hinges"
SIZE = (330, 250)
LYING = Camera(-60.0, 28.0, up=(0.0, 1.0, 0.0))
ALONG = Camera(-90.0, 8.0, up=(0.0, 1.0, 0.0))


def halves(hinge: SingleHinge) -> list[Any]:
    """Both halves, and the loose pin if there is one."""
    return [hinge.parent_half, hinge.child_half, *([hinge.hardware] if hinge.hardware else [])]


def cut(shapes: Sequence[Any], plane: Plane = Plane.YZ) -> list[Any]:
    """Cut shapes open by taking away what lies before a plane through the axis."""
    box = plane.location * Pos(0, 0, 50) * Box(200, 200, 100)
    return [shape - box for shape in shapes]


def picture(shapes: Sequence[Any], camera: Camera = LYING, size: tuple[int, int] = SIZE) -> Any:
    """Draw shapes, blue, orange and grey in turn."""
    colors = (PALETTE[0], PALETTE[1], PALETTE[3])
    return render(bodies_of(shapes, colors), size, camera)


def page(name: str, rows: Sequence[tuple[str, Any]], columns: int = 3) -> None:
    """Save labelled pictures as one."""
    save(sheet([image for _, image in rows], [text for text, _ in rows], columns), HOME / name)
    print(name, (HOME / name).stat().st_size // 1024, "kB")


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
            ("Leaf(14, 2)", picture(halves(SingleHinge(40, leaf=Leaf(14, 2), **leaf)))),
            (
                "Leaf(..., holes=3, sink=6)",
                picture(halves(SingleHinge(40, leaf=Leaf(14, 2, holes=3, sink=6), **leaf))),
            ),
            (
                "Leaf(..., flat=True)",
                picture(
                    halves(SingleHinge(40, radius=3, clearance=0.3, leaf=Leaf(14, 1.9, flat=True))),
                    Camera(-60.0, -28.0, up=(0.0, 1.0, 0.0)),
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
        rows.append((text, picture(cut(halves(hinge), Plane.YZ), Camera(15.0, 12.0, up=(0, 1, 0)))))
    page("pins.png", rows)
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
    bump = Pos(0, 0, 0) * clicks.parent_half
    rows += [
        ("detents: the bump", picture([_end(bump, -3.5)], Camera(-70.0, 40.0, up=(0, 0, 1)))),
        (
            "detents: dimples and tracks",
            picture([clicks.child_half], Camera(60.0, -40.0, up=(0, 0, 1))),
        ),
    ]
    page("stops.png", rows)


def _end(shape: Any, level: float) -> Any:
    """Keep what lies below a level of z."""
    return shape - Pos(0, 0, level + 50) * Box(200, 200, 100)


def double_pictures() -> None:
    """Every parameter of the double hinge."""

    def draw(camera: Camera = LYING, **options: Any) -> Any:
        hinge = DoubleHinge(**{"size": 20, "clearance": 0.3, **options})
        colors = (PALETTE[0], PALETTE[2], PALETTE[1])
        bodies = [
            body
            for solid, color in zip(hinge.solids(), colors, strict=True)
            for body in bodies_of([solid], (color,))
        ]
        return render(bodies, SIZE, camera)

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
        ("parent_carve", render(bodies_of([hinge.parent_carve]), SIZE, LYING)),
        ("parent's box", render(bodies_of([parent]), SIZE, Camera(40.0, 28.0, up=(0, 1, 0)))),
    ]
    parent.joints["link"].connect_to(link.joints["parent"], angle=120)
    link.joints["child"].connect_to(child.joints["link"], angle=60)
    colors = (PALETTE[0], PALETTE[2], PALETTE[1])
    rows.append(("fit(box, box)", render(bodies_of([parent, link, child], colors), SIZE, LYING)))
    page("double_fit.png", rows)


def other_pictures() -> None:
    """Magnets, snap tongues and the coupon."""
    block = Pos(0, 0, -4) * Box(14, 14, 8)
    closed = MagnetPocket(Magnet(6, 3), "captured", mode=Mode.PRIVATE)
    round_ = MagnetPocket(Magnet(6, 3), mode=Mode.PRIVATE)
    square = MagnetPocket(Magnet(6, 3, "square"), mode=Mode.PRIVATE)
    upright = Camera(-60.0, 35.0)
    tongue, dimple = SnapTongue(mode=Mode.PRIVATE), SnapDimple(mode=Mode.PRIVATE)
    mate = Pos(0, 0, 5.3) * Box(10, 10, 10) - dimple
    base = Pos(0, 0, -2) * Box(10, 10, 4)
    whole = [base + tongue, mate]
    page(
        "retention.png",
        [
            ("MagnetPocket, press fit", picture([block - round_], upright)),
            ("square", picture([block - square], upright)),
            (
                "captured by a pause (cut open)",
                picture(cut([block - closed, closed.magnet_part], Plane.XZ), upright),
            ),
            ("SnapTongue", picture([base + tongue], upright)),
            ("SnapDimple (cut open)", picture(cut([mate], Plane.XZ), upright)),
            ("closed (cut open)", picture(cut(whole, Plane.XZ), Camera(-90.0, 10.0))),
        ],
    )
    assert SnapSpec().strain < 0.008
    coupon = Coupon()
    bodies = [
        Body(mesh.vertices, mesh.faces, PALETTE[3] if not index else PALETTE[(index - 1) % 3])
        for index, mesh in enumerate(coupon.meshes)
    ]
    save(render(bodies, (960, 420), Camera(-75.0, 48.0)), HOME / "coupon.png")


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
    upright = Camera(-55.0, 35.0)
    rows = [("07: as printed", picture([box, lid], upright))]
    box.joints["hinge"].connect_to(lid.joints["hinge"], angle=120)
    rows.append(("07: half closed", picture([box, lid], upright)))
    base, back, link, lip = load("09_phone_stand_build123d").main()
    base.joints["back"].connect_to(back.joints["back"], angle=103)
    base.joints["link"].connect_to(link.joints["parent"], angle=180)
    link.joints["child"].connect_to(lip.joints["link"], angle=0)
    bodies = bodies_of([base, back, link, lip], (PALETTE[0], PALETTE[1], PALETTE[2], PALETTE[3]))
    rows.append(("09: in use", render(bodies, SIZE, Camera(-30.0, 20.0))))
    page("examples.png", rows)


def main() -> None:
    """Draw all of them."""
    single_pictures()
    pin_pictures()
    stop_pictures()
    double_pictures()
    other_pictures()
    example_pictures()


if __name__ == "__main__":
    main()
