"""The model of a network: sections, beams, shapes, networks, drives, and the numbers that the engine gives to their parts."""
