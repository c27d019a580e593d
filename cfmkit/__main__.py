"""``python -m cfmkit`` is ``cfmkit``."""

import sys

from cfmkit.cli.main import main

sys.exit(main())
