"""Values that a measured loop gives: the causes of its departure from the model, by name."""

DEVIATION_DEFINITIONS = {
    "data_friction": (
        "ratio",
        "rolling friction whose loop has the measured area, over the displacements that are compared",
    ),
    "data_rest_error": (
        "length",
        "by how much the springs' rest length must exceed the stated one to explain the measured midline",
    ),
    "data_off_design": ("force", "root mean square of the measured force less that of the design without friction"),
    "data_by_profile": ("force", "root mean square contribution of the measured errors of the profile"),
    "data_by_friction": ("force", "root mean square contribution of the friction that gives the measured loop area"),
    "data_by_rest_length": ("force", "root mean square contribution of the springs' rest length, its error included"),
    "data_unexplained": ("force", "root mean square of the remainder"),
}
