"""What pyproject.toml cannot say: the folder `configs` is the package `cfmkit.configs` of a wheel.

So the examples stand once in the tree, where everybody looks for them, and come with every installation.
"""

from setuptools import find_packages, setup

ROOMS = ("", ".studies", ".synthetic")

setup(
    packages=[*find_packages(include=["cfmkit*"]), *(f"cfmkit.configs{room}" for room in ROOMS)],
    package_dir={"cfmkit.configs": "configs"},
)
