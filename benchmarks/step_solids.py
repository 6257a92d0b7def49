"""Count the solids of each kit's STEP with gmsh: python benchmarks/step_solids.py KIT [KIT ...].

Wants the command gmsh (Debian's package). Prints a line a kit, and exits 1 where the number of
solids is not the number of bodies in tree.json.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

SCRIPT = """
SetFactory("OpenCASCADE");
v() = ShapeFromFile("{step}");
Printf("solids %g", #v()) > "{out}";
Exit;
"""


def solids_in(step: Path) -> int:
    """Number of solids that gmsh reads from a STEP file."""
    with tempfile.TemporaryDirectory() as folder:
        script, out = Path(folder) / "count.geo", Path(folder) / "out.txt"
        script.write_text(SCRIPT.format(step=step.resolve(), out=out))
        subprocess.run(["gmsh", "-v", "1", "-", str(script)], check=True, capture_output=True)
        return int(out.read_text().split()[-1])


def main() -> int:
    """Count and compare; 1 where a kit differs."""
    good = True
    for kit in map(Path, sys.argv[1:]):
        (step,) = kit.glob("*.step")
        bodies = len(json.loads((kit / "tree.json").read_text(encoding="utf-8"))["bodies"])
        solids = solids_in(step)
        good &= solids == bodies
        print(f"{step}: gmsh counts {solids} solids, {bodies} bodies")
    return int(not good)


if __name__ == "__main__":
    sys.exit(main() if len(sys.argv) > 1 else __doc__)
