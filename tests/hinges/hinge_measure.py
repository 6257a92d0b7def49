"""Gaps, overlaps and piece counts of posed bodies, measured on their meshes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import manifold3d as m3
import numpy as np

from hinges.exact_solids import build_half
from hinges.plan_double import DoublePlan, child_pose, link_pose
from hinges.plan_single import SinglePlan
from hinges.shape_meshes import half_manifolds
from hinges.shapes import HalfPlan

SEGMENTS = 64


@cache
def _manifolds(plan: HalfPlan) -> tuple[m3.Manifold, m3.Manifold]:
    return half_manifolds(plan, SEGMENTS)


def mesh_of(plan: HalfPlan) -> m3.Manifold:
    return _manifolds(plan)[0]


@cache
def exact(plan: HalfPlan, name: str = "half"):
    """The exact half; raises if it is not one valid solid."""
    return build_half(plan, name).solid()


def overlap(one: m3.Manifold, other: m3.Manifold) -> float:
    return float((one ^ other).volume())


def gap(one: m3.Manifold, other: m3.Manifold, up_to: float = 3.0) -> float:
    return float(one.min_gap(other, up_to))


def turned(solid: m3.Manifold, angle: float) -> m3.Manifold:
    return solid.rotate((0.0, 0.0, angle))


def block(size: float, west: float, gap_mm: float) -> m3.Manifold:
    """A box below y = 0, centred in z, inset by half the gap."""
    inset = 0.5 * gap_mm
    side = size - gap_mm
    return m3.Manifold.cube((side, side, side)).translate(
        (west + inset, -size + inset, -0.5 * size + inset)
    )


def fitted(body: m3.Manifold, plan: HalfPlan) -> m3.Manifold:
    half, carve = _manifolds(plan)
    return body - carve + half


def pieces(solid: m3.Manifold) -> int:
    return len(solid.decompose())


def single_gaps(plan: SinglePlan, angles: Sequence[float], size: float | None = None):
    """Smallest gap and overlap of the two halves (in boxes of `size`) at each angle.

    Gaps are looked for up to a little more than the clearance, which is far quicker.
    """
    up_to = plan.spec.clearance.least + 0.06
    parent, child = mesh_of(plan.parent), mesh_of(plan.child)
    if size is not None:
        parent = fitted(block(size, -size, plan.spec.gap), plan.parent)
        child = fitted(block(size, 0.0, plan.spec.gap), plan.child)
    assert pieces(parent) == pieces(child) == 1
    poses = [turned(child, angle) for angle in angles]
    return np.array([(gap(parent, one, up_to), overlap(parent, one)) for one in poses])


def double_bodies(plan: DoublePlan, *, boxes: bool):
    parent, link, child = (mesh_of(half) for half in (plan.parent, plan.link, plan.child))
    if boxes:
        size, inset = plan.spec.size, 0.5 * plan.spec.gap
        side = size - 2.0 * inset
        box = m3.Manifold.cube((side, side, side))
        box = box.translate((-size + inset, -0.5 * size + inset, -0.5 * size + inset))
        parent = fitted(box, plan.parent)
        child = fitted(box.translate((size, 0.0, 0.0)), plan.child)
    return parent, link, child


def posed(plan: DoublePlan, link: m3.Manifold, child: m3.Manifold, first: float, second: float):
    spec = plan.spec
    return (
        link.transform(link_pose(spec, first)[:3]),
        child.transform(child_pose(spec, first, second)[:3]),
    )


def boxes_apart(plan: DoublePlan, first: float, second: float) -> bool:
    """Whether two ideal boxes, a hundredth smaller than their cells, are apart in this pose."""
    size = plan.spec.size
    box = m3.Manifold.cube((size * 0.99,) * 3, True)
    parent = box.translate((-0.5 * size, 0.0, 0.0))
    child = box.translate((0.5 * size, 0.0, 0.0))
    child = child.transform(child_pose(plan.spec, first, second)[:3])
    return overlap(parent, child) < 1e-6
