"""A network of beams as a specification describes it."""
