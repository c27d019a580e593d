"""What pyproject.toml cannot say: compiled code, two folders of the tree that are packages, where the README links to.

The beam engine has its inner loops in C. Without a compiler it is installed all the same and runs on numpy, slower.

`configs` becomes `cfmkit.configs`, the pages of `docs` become `cfmkit.docs`: so examples and documentation stand once
in the tree, where everybody looks for them, and come with every installation.

The README links to files of the tree. Where `CFMKIT_URL` says where the tree is published, the links of the package's
description become addresses there, and the package has project URLs; else they become the command that shows the page.
"""

import os
import re
import shutil
from pathlib import Path

from setuptools import Extension, find_packages, setup
from setuptools.command.build_py import build_py

try:
    from setuptools.command.bdist_wheel import bdist_wheel
except ImportError:  # before setuptools 70.1, which a build has: this file is only read
    bdist_wheel = object

HERE = Path(__file__).parent
CONFIG_SUBFOLDERS = ("", ".studies", ".synthetic")
README_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:)([^)#\s]+)(#[^)\s]*)?\)")


MECHANICS = "cfmkit/elastica/mechanics"
C_FILES = "module", "march", "compare", "newton", "terms", "contact", "sides", "gaps", "factor"
MARCH = Extension(
    "cfmkit.elastica.mechanics._march",
    [f"{MECHANICS}/{name}.c" for name in C_FILES],
    depends=[f"{MECHANICS}/march.h"],
    libraries=[] if os.name == "nt" else ["m"],
    extra_compile_args=[] if os.name == "nt" else ["-O3", "-std=c99"],
    py_limited_api=True,  # one file for every Python from 3.11 on
    optional=True,
)


class WheelForEveryPython(bdist_wheel):
    """Build one wheel for every Python from 3.11 on; for any platform if there was no compiler."""

    def run(self):
        """Compile first: the wheel's name says what came of it."""
        # modules that are gone since an earlier build would come into the wheel
        shutil.rmtree(self.get_finalized_command("build").build_lib, ignore_errors=True)
        self.run_command("build_ext")
        built = self.get_finalized_command("build_ext").get_outputs()
        if not any(Path(file).exists() for file in built):
            self.distribution.ext_modules = []
            self.root_is_pure = True
        super().run()


class BuildPages(build_py):
    """Build without the programs that stand beside the pages of `docs`: they make the site.

    Links of the pages to files of the package lead there from inside of it.
    """

    def run(self):
        """Build, then shorten those links."""
        super().run()
        for page in Path(self.build_lib, "cfmkit", "docs").glob("*.md"):
            page.write_text(page.read_text(encoding="utf-8").replace("](../cfmkit/", "](../"), encoding="utf-8")

    def find_package_modules(self, package, package_dir):
        """Return the modules of a package, as (package, name, file)."""
        modules = super().find_package_modules(package, package_dir)
        return [] if package == "cfmkit.docs" else modules


def describe_package(text, url):
    """Return the README with links that work outside of the tree."""

    def replace_link(match):
        picture, name, path, anchor = match.groups()
        if url:
            view = "raw" if picture else "blob"
            return f"{picture}[{name}]({url}/{view}/main/{path}{anchor or ''})"
        if picture:
            return f"*{name}*"
        page = re.fullmatch(r"docs/(\w+)\.md", path)
        return f"{name} (`cfmkit docs {page[1]}`)" if page else name

    return README_LINK.sub(replace_link, text)


URL = os.environ.get("CFMKIT_URL", "").rstrip("/")

setup(
    packages=[
        *find_packages(include=["cfmkit*"]),
        *(f"cfmkit.configs{subfolder}" for subfolder in CONFIG_SUBFOLDERS),
        "cfmkit.docs",
        "cfmkit.docs.images",
        "cfmkit.families.beam.shapes",  # data of the family, no module: setuptools wants every folder of data named
    ],
    package_dir={"cfmkit.configs": "configs", "cfmkit.docs": "docs"},
    ext_modules=[MARCH],
    cmdclass={"build_py": BuildPages} | ({} if bdist_wheel is object else {"bdist_wheel": WheelForEveryPython}),
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
    long_description=describe_package((HERE / "README.md").read_text(encoding="utf-8"), URL),
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
