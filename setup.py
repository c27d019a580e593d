"""What pyproject.toml cannot say: two folders of the tree are packages of a wheel, and where the README's links lead.

`configs` becomes `cfmkit.configs`, the pages of `docs` become `cfmkit.docs`: so examples and documentation stand once
in the tree, where everybody looks for them, and come with every installation.

The README links to files of the tree. Where `CFMKIT_URL` says where the tree is published, the links of the package's
description become addresses there, and the package has project URLs; else they become the command that shows the page.
"""

import os
import re
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).parent
ROOMS = ("", ".studies", ".synthetic")
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:)([^)#\s]+)(#[^)\s]*)?\)")


class BuildPages(build_py):
    """Build without the programs that stand beside the pages of `docs`: they make the site."""

    def find_package_modules(self, package, package_dir):
        """Return the modules of a package, as (package, name, file)."""
        found = super().find_package_modules(package, package_dir)
        return [] if package == "cfmkit.docs" else found


def described(text, url):
    """Return the README with links that work outside of the tree."""

    def linked(match):
        picture, name, path, place = match.groups()
        if url:
            way = "raw" if picture else "blob"
            return f"{picture}[{name}]({url}/{way}/main/{path}{place or ''})"
        if picture:
            return f"*{name}*"
        page = re.fullmatch(r"docs/(\w+)\.md", path)
        return f"{name} (`cfmkit docs {page[1]}`)" if page else name

    return LINK.sub(linked, text)


URL = os.environ.get("CFMKIT_URL", "").rstrip("/")

setup(
    packages=[
        *find_packages(include=["cfmkit*"]),
        *(f"cfmkit.configs{room}" for room in ROOMS),
        "cfmkit.docs",
        "cfmkit.docs.images",
        "cfmkit.families.beam.shapes",  # data of the family, no module: setuptools wants every folder of data named
    ],
    package_dir={"cfmkit.configs": "configs", "cfmkit.docs": "docs"},
    cmdclass={"build_py": BuildPages},
    long_description=described((HERE / "README.md").read_text(encoding="utf-8"), URL),
    long_description_content_type="text/markdown",
    project_urls={
        "Homepage": URL,
        "Documentation": f"{URL}/blob/main/docs/index.md",
        "Changes": f"{URL}/blob/main/CHANGELOG.md",
        "Issues": f"{URL}/issues",
    }
    if URL
    else {},
)
