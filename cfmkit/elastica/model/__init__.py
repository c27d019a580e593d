"""The model of a network: sections, beams, shapes, drives, and the numbers that the engine gives to their parts."""
