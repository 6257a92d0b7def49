"""A printer of your own: from a test print to hinges that turn on it.

    python examples/04_own_printer.py [FOLDER]

A profile says what a printer can do: the gap that hinges need, the thinnest wall, the bed. fabfold
has some, yours is measured: print the coupon, see which hinge turns, write it down.
"""

import sys
from pathlib import Path

import trimesh

from fabfold import Kit, load_profile, profile_names
from fabfold.printing.calibrate import calibrate, write_profile
from fabfold.printing.profile_coupon import make_coupon


def main(folder: str = "my-printer") -> None:
    home = Path(folder)
    home.mkdir(parents=True, exist_ok=True)
    print("Profiles that come with fabfold:", *profile_names())

    # 1. A coupon: one plate of hinges, each with another clearance. Print it.
    coupon = make_coupon(home / "coupon.3mf", "mjf-pa12", "0.2,0.3,0.4,0.5")
    print("Print", coupon[0], "and read", coupon[1])

    # 2. What you saw: the hinge at 0.4 mm turned freely, the one at 0.3 mm was fused.
    #    In a terminal: fabfold calibrate --profile mjf-pa12 --turns-freely 0.4 --fuses 0.3
    mine = calibrate(load_profile("mjf-pa12"), turns_freely_mm=0.4, fuses_mm=0.3, name="my-printer")

    # 3. A text file, in which the other figures can be changed too.
    profile = home / "my-printer.toml"
    write_profile(profile, mine)
    print(profile.read_text(encoding="utf-8"))

    # 4. A kit for this printer. A profile is a name or such a file.
    bar = home / "bar.stl"
    trimesh.creation.box((80.0, 10.0, 10.0)).export(bar)
    kit = Kit.from_model(
        bar, template="box-2x2x2", profile=str(profile), folder=home / "bar-kit", effort="quick"
    )
    built = kit.join()
    gap = built.planned.motion.certificate["min_gap_mm"]
    print(f"The hinges have {built.joinery.clearance_mm:g} mm of clearance.")
    print(f"Gaps under {mine.min_gap_mm:g} mm may close in print; the smallest is {gap:.2f} mm.")
    kit.export()


if __name__ == "__main__":
    main(*sys.argv[1:])
