"""What a process errs in on a mechanism with an adjustable force."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfmkit.families.vcfm.spec import VcfmSpec


def errors(_spec: VcfmSpec) -> dict[str, str]:
    """Return which values a process errs in: the thicknesses of both kinds of leaves."""
    return {f"mechanism.{one}.thickness": "thickness" for one in ("positive", "bistable")}
