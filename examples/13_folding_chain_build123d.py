"""Six cubes in a row on five double hinges: a chain that folds into a block by its joints alone.

Each link plate lies flat between two cubes until it is turned. Run it with a folder to write to:
``python 13_folding_chain_build123d.py out``.
"""

import sys
from pathlib import Path

from build123d import Box, Part, Pos

from hinges import DoubleHinge, write_3mf

SIDE, GAP = 20.0, 0.3
#: Of each hinge: the direction of its two axes' edges, and the angles at which the chain is folded.
HINGES = (
    ("y", (0, 180)),
    ("z", (0, 180)),
    ("y", (0, 180)),
    ("z", (180, 0)),
    ("y", (0, 180)),
)


def main() -> tuple[list[Part], list[Part]]:
    """Cubes and links in a row, as they print."""
    side = SIDE - GAP
    cubes: list[Part] = [Pos(SIDE * n) * Box(side, side, side) for n in range(len(HINGES) + 1)]
    links = []
    for n, (edge, _) in enumerate(HINGES):
        hinge = DoubleHinge(SIDE, first=f"+{edge}", second=f"-{edge}", clearance=GAP)
        cubes[n], link, cubes[n + 1] = hinge.fit(
            cubes[n], cubes[n + 1], Pos(SIDE * (n + 0.5)), joint=f"link {n}"
        )
        links.append(link)
    return cubes, links


def fold(cubes: list[Part], links: list[Part]) -> None:
    """Turn every link on its cube, and the next cube on the link."""
    for n, (link, (_, (first, second))) in enumerate(zip(links, HINGES, strict=True)):
        cubes[n].joints[f"link {n}"].connect_to(link.joints["parent"], angle=first)
        link.joints["child"].connect_to(cubes[n + 1].joints[f"link {n}"], angle=second)


if __name__ == "__main__":
    cubes, links = main()
    if len(sys.argv) > 1:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        write_3mf([*cubes, *links], folder / "chain.3mf")
    fold(cubes, links)
    for number, cube in enumerate(cubes):
        x, y, z = (round(value / SIDE) for value in cube.bounding_box().center())
        print(f"cube {number} lies in cell {x} {y} {z}")
