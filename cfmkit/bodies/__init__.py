"""Rigid parts that families share: cam profiles and the tracks of rollers on them."""
