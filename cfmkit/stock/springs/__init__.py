"""Springs that can be bought: own lists, and a generic series that is computed from wire, coil and turns."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "compression_springs": "CompressionSpring",
        "extension_springs": "ExtensionSpring",
        "kinds": "HELICAL_KINDS",
        "offers": "generic_series",
        "torsion_springs": "HelicalTorsionSpring",
        "wire_materials": "WIRES_BY_NAME",
    },
)
