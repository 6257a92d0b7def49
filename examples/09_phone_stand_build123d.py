"""A phone stand that folds: a hinge with a stop behind, a double hinge in front.

The back turns up from flat and its stop holds it at 70° over the base. The lip hangs on a link
plate: turned over it stands on the base and keeps the phone from sliding, turned under it lifts the
base's front. Run it with a folder to write to: ``python 09_phone_stand_build123d.py out``.
"""

import sys
from pathlib import Path

from build123d import Box, Compound, Part, Plane, Pos, export_step

from hinges import Bracket, DoubleHinge, SingleHinge, Stops, hinge_location

GAP = 0.3
WIDE, LONG, TALL, THICK = 70.0, 80.0, 90.0, 16.0
LEAN = 110.0  # from flat behind the base: the back then stands at 70° over it


def slab(wide: float, long: float, y: float) -> Part:
    """A slab whose top lies just below z = 0, half a gap inside its limits."""
    return Pos(0, y, -0.5 * THICK) * Box(wide - GAP, long - GAP, THICK - GAP)


def main() -> tuple[Part, Part, Part, Part]:
    """Base, back, link and lip, all flat."""
    base = slab(WIDE, LONG, -0.5 * LONG)
    back = slab(WIDE, TALL, 0.5 * TALL)
    lip = slab(WIDE, THICK, -LONG - 0.5 * THICK)

    hinge = SingleHinge(
        WIDE,
        knuckles=5,
        clearance=GAP,
        angular_range=(0.0, LEAN),
        leaf=Bracket(7.0),
        stops=Stops(upper=True, reach=6.5),
    )
    behind = hinge_location((0, 0, 0), along=(1, 0, 0), outwards=(0, 0, 1))
    base, back = hinge.fit(base, back, behind, joint="back")

    # The face between base and lip: x points from base to lip, z up.
    front = Plane(origin=(0, -LONG, -0.5 * THICK), x_dir=(0, -1, 0), z_dir=(0, 0, 1))
    double = DoubleHinge(THICK, first="+z", second="-z", turns=(180, 180), clearance=GAP)
    base, link, lip = double.fit(base, lip, front)

    base.label, back.label, link.label, lip.label = "base", "back", "link", "lip"
    return base, back, link, lip


if __name__ == "__main__":
    base, back, link, lip = main()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        export_step(Compound(children=[base, back, link, lip]), folder / "phone_stand.step")
    base.joints["back"].connect_to(back.joints["back"], angle=LEAN - 5)
    base.joints["link"].connect_to(link.joints["parent"], angle=180)
    link.joints["child"].connect_to(lip.joints["link"], angle=0)
    gap = base.solid().shells()[0].distance_to(lip.solid().shells()[0])
    print(f"in use, with {gap:.3f} mm between base and lip")
