"""``python -m compare`` is ``dualball``."""

import sys

from compare.commands.cli import main

sys.exit(main())
