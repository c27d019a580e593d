"""``python -m cfmkit`` is ``cfmkit``."""

import sys

from cfmkit.cli.main import entry

sys.exit(entry())
