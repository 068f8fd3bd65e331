"""``python -m compare`` is ``dualball``."""

import sys
from pathlib import Path

if sys.path[:1] == [str(Path.cwd())] != [str(Path(__file__).parents[1])]:
    del sys.path[0]  # `python -m` puts the current folder first, where a foreign `model` may be; `dualball` doesn't

from compare.commands.cli import main

sys.exit(main())
