"""Print the oldest versions that pyproject.toml allows, as constraints for pip: ``numpy==2.0``.

Run ``python tools/oldest_versions.py cluster test > oldest.txt`` and ``pip install -c oldest.txt '.[cluster,test]'``;
the arguments are extras whose packages count, too.
"""

import re
import sys
import tomllib
from pathlib import Path

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"


def oldest(extras=()):
    """Return the lower bound of each dependency by its name."""
    project = tomllib.loads(PYPROJECT.read_text())["project"]
    needed = [*project["dependencies"], *(one for extra in extras for one in project["optional-dependencies"][extra])]
    bounds = (re.fullmatch(r"([\w.-]+)>=([\d.]+)", one) for one in needed)
    return {one[1]: one[2] for one in bounds if one}


if __name__ == "__main__":
    print("\n".join(f"{name}=={version}" for name, version in oldest(sys.argv[1:]).items()))
