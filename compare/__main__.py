"""``python -m compare`` is ``dualball``."""

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import NoReturn

from compare.campaign.stops import SIGNALS


def main() -> NoReturn:
    """The program; what ends it while it is being imported ends it at once: nothing is lost."""

    def leave(number: int, frame: FrameType | None) -> NoReturn:
        with suppress(OSError):  # standard error may be closed
            os.write(2, b"dualball: interrupted\n")
        os._exit(128 + number)

    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # closed: the next file would take its place, and what a library prints
            os.open(os.devnull, os.O_RDWR)
    if not sys.stdout or not sys.stderr:
        nowhere = Path(os.devnull).open("w")  # noqa: SIM115  (for as long as the process lasts)
        sys.stdout, sys.stderr = sys.stdout or nowhere, sys.stderr or nowhere
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, leave)
    from compare.commands.cli import program

    program()


if __name__ == "__main__":
    # `python -m` puts the current folder first, where a foreign `model` may be; `dualball` doesn't.
    with suppress(FileNotFoundError):  # it was deleted
        if sys.path[:1] == [str(Path.cwd())] != [str(Path(__file__).parents[1])]:
            del sys.path[0]
    main()
