"""Independent solutions that the engine is compared with."""
