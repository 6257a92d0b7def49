"""A tolerance coupon with clearances of your own choice.

Run it with a folder to write to: ``python 04_tolerance_coupon.py out``.
"""

import sys
from pathlib import Path

from hinges import Clearance, Coupon, SingleHinge, play, write_coupon

CLEARANCES = (0.2, 0.3, 0.4)


def main() -> Coupon:
    coupon = Coupon(CLEARANCES)
    print(f"{len(coupon.solids())} bodies: {', '.join(coupon.names[:4])}, ...")
    for clearance in CLEARANCES:
        found = play(SingleHinge(20, clearance=Clearance(clearance)), angle=60)
        print(
            f"{clearance:.2f} mm: plays {found.radial:.2f} mm across, {found.axial[1]:.2f} mm "
            f"along, tilts {found.tilt:.1f}°"
        )
    return coupon


if __name__ == "__main__":
    main()
    if len(sys.argv) > 1:
        print(*write_coupon(Path(sys.argv[1]) / "coupon.3mf", CLEARANCES), sep="\n")
