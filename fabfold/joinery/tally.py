"""What the stages of a build took away and added, counted for the report."""

from __future__ import annotations

from dataclasses import dataclass, field

from fabfold.joinery.sizes import strut_width

__all__ = ["FRAGMENT_SHARE", "BuildTally"]

#: Loose pieces below this share of a full cell's volume are fragments: they are left out.
FRAGMENT_SHARE = 0.005


@dataclass
class BuildTally:
    """Running counts of one build; the stages add to them.

    Attributes
    ----------
    carved_cells : int
        Number of cells that lost material to grooves and pockets.
    carved_mm3 : float
        Volume of that material in mm³.
    shared_cells : int
        Number of voxels that share a cell of the box with another one.
    shared_mm3 : float
        Volume in mm³ cut off them so that each keeps to its octants.
    dropped_mm3 : float
        Volume in mm³ of the loose fragments that were left out.
    fragments : int
        Number of loose fragments that were left out.
    hollows : int
        Number of closed hollows that were filled.
    filled_mm3 : float
        Volume of these hollows in mm³.
    links_cut : int
        Number of link plates that lost material.
    links_mm3 : float
        Volume of that material in mm³.
    struts : int
        Number of struts that were added.
    strutted : list of str
        Names of the bodies that have struts.
    """

    carved_cells: int = 0
    carved_mm3: float = 0.0
    shared_cells: int = 0
    shared_mm3: float = 0.0
    dropped_mm3: float = 0.0
    fragments: int = 0
    hollows: int = 0
    filled_mm3: float = 0.0
    links_cut: int = 0
    links_mm3: float = 0.0
    struts: int = 0
    strutted: list[str] = field(default_factory=list)

    def notes(self, voxel_mm: float, links: int) -> tuple[str, ...]:
        """What was done, in a maker's words.

        Parameters
        ----------
        voxel_mm : float
            Side of a voxel in mm.
        links : int
            Number of link plates of the kit.

        Returns
        -------
        tuple of str
            One sentence for each thing that was done.
        """
        notes = []
        if self.carved_cells:
            notes.append(
                f"{self.carved_mm3:.0f} mm³ taken out of {self.carved_cells} cells so that hinge "
                + ("barrels and link plates can pass" if links else "barrels can pass")
            )
        if self.links_mm3 > 0.01:
            notes.append(
                f"{self.links_mm3:.0f} mm³ taken out of {self.links_cut} of {links} link plates so "
                "that hinge barrels and other links can pass"
            )
        if self.shared_cells:
            notes.append(
                f"{self.shared_cells} voxels share {self.shared_cells // 2} cells of the box, two "
                f"and two; {self.shared_mm3:.0f} mm³ cut off them so that each keeps to its eighths"
            )
        if self.hollows:
            notes.append(
                f"{self.hollows} closed hollows filled, {self.filled_mm3:.0f} mm³ in all: "
                "nothing could be cleaned out of them"
            )
        if self.fragments:
            notes.append(
                f"{self.fragments} loose crumbs left out, {self.dropped_mm3:.0f} mm³ in all "
                f"(each below {FRAGMENT_SHARE * voxel_mm**3:.0f} mm³)"
            )
        if self.struts:
            notes.append(
                f"{self.struts} struts of {strut_width(voxel_mm):.1f} mm added in "
                + ", ".join(self.strutted)
            )
        return tuple(notes)
