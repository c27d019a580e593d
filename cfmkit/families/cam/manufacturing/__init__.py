"""What errors of manufacturing do to the force of a cam: drawn from stated tolerances, many times."""
