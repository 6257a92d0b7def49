"""Check of the meshes' topology by MeshLab."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fabfold.joinery.bodies import BodyMesh
from fabfold.printing.checks import Check
from fabfold.progress import Progress
from fabfold.solid.convert import to_mesh_set
from fabfold.solid.crossing import crossing_triangles

__all__ = ["check_topology"]


def check_topology(bodies: Sequence[BodyMesh], progress: Progress) -> list[Check]:
    """Check that every mesh is closed, two-manifold, one piece and free of self-intersections.

    Parameters
    ----------
    bodies : sequence of BodyMesh
        The printed bodies.
    progress : Progress
        Is told which body is looked at.

    Returns
    -------
    list of Check
        Four checks over all bodies, as MeshLab sees them.
    """
    names = [body.name for body in bodies]
    opened, branching, pieces, crossing = [], [], [], []
    for index, body in enumerate(bodies):
        progress.update(0.4 * index / len(names), f"mesh of {body.name}")
        meshes = to_mesh_set(body.vertices, body.faces)
        measures = meshes.get_topological_measures()
        opened.append(int(measures["boundary_edges"]))
        branching.append(_shared_edges(body) + int(measures["non_two_manifold_vertices"]))
        pieces.append(int(measures["connected_components_number"]) - 1)
        crossing.append(len(crossing_triangles(body.vertices, body.faces)))
    count = len(names)

    def check(name: str, values: list[int], unit: str, fine: str) -> Check:
        bad = _worst(names, values)
        return Check(name, float(sum(values)), 0.0, unit, not bad, bad or fine)

    return [
        check("closed surfaces", opened, "open edges", f"all {count} meshes are watertight"),
        check(
            "two-manifold surfaces",
            branching,
            "edges and corners",
            "no edge or corner where more than two sheets meet",
        ),
        check(
            "one piece a body",
            pieces,
            "loose pieces",
            f"{count} bodies, {count} pieces: nothing falls out of the printer",
        ),
        check(
            "surfaces that cross themselves",
            crossing,
            "triangles",
            "slicers and CAD read every body as a plain solid",
        ),
    ]


def _shared_edges(body: BodyMesh) -> int:
    """Edges of more than two triangles: MeshLab finds them, but its count differs between runs."""
    edges = np.sort(body.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int((counts > 2).sum())


def _worst(names: list[str], values: list[int]) -> str:
    """Names of the bodies with a value above zero."""
    bad = [f"{name} ({value})" for name, value in zip(names, values, strict=True) if value]
    return ", ".join(bad[:5]) + (f" and {len(bad) - 5} more" if len(bad) > 5 else "")
