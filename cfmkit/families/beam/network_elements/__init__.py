"""The parts that a planar network is made of, as a specification describes them."""
