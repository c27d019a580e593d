"""What a process errs in on a mechanism with an adjustable force."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfmkit.families.vcfm.spec import VcfmSpec


def errors(spec: VcfmSpec) -> dict[str, str]:
    """Return which values a process errs in: the thicknesses of both kinds of leaves; bought springs have none."""
    made = ("positive", "bistable") if spec.mechanism.springs is None else ("bistable",)
    return {f"mechanism.{one}.thickness": "thickness" for one in made}
