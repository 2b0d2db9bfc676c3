"""``python -m mapweave``: the same program as ``mapweave``."""

import sys

from mapweave.cli import main

sys.exit(main())
