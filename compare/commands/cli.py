"""The program ``dualball``: one command line for everything. Commands are declared in `parsers`.

Exit codes: 0 done and as expected, 1 a verdict on the engine on trial failed, a run broke down or
a design doesn't reach its fastest flow, 2 a mistake in what was asked, 130 interrupted by Ctrl-C,
143 by SIGTERM, 129 by a terminal that is closed, 152 where processor time is used up."""

import argparse
import errno
import gc
import importlib
import io
import itertools
import os
import re
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from typing import NoReturn

from compare.commands import signals, waiting
from model import InputError, SimulationError
from model.files import leave
from model.versions import version


def program() -> NoReturn:
    """This process as the program: ends with the exit code, and at once for a second signal.

    What standard output can't show in its encoding is spelled."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="spelled")
    # figures go into files: that of a notebook would be looked for here, too
    os.environ["MPLBACKEND"] = "agg"
    os.environ["MUJOCO_GL"] = "disable"  # nothing draws with OpenGL
    # threads of OpenBLAS wait for one another by spinning, which is most of their time where others
    # are at work, too
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with signals.on_first_signal(signals.end):
        try:
            code = main()
        except SystemExit as done:  # as of --help
            code = int(done.code or 0)
        try:
            sys.stdout.flush()
        except OSError as error:  # nobody reads it, as with `| head`, or the disk is full
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            if code == 0 and not isinstance(error, BrokenPipeError):
                code = _ended(2, f"error: cannot write to standard output: {error.strerror}")
        if code >= 128:  # threads may still be at what nobody wants any more
            gc.collect()  # lets go of what workers shared
            leave(code)
    sys.exit(code)


_FULL = errno.ENOSPC, errno.EFBIG, errno.EDQUOT
MOST_SAID = 2000
"""Characters of a refusal, at most."""


def _brief(said: str) -> str:
    """What is said of a mistake, without the middle if it repeats something huge."""
    half = MOST_SAID // 2
    return said if len(said) <= MOST_SAID else f"{said[:half]} … {said[-half:]}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program with arguments, the process's own for None; return its exit code."""
    args = argparse.Namespace(resumes=False)
    try:
        return _run(sys.argv[1:] if argv is None else argv, args)
    except InputError as error:
        named = re.sub(r"^t_end\b", "time", str(error))  # as the option is called
        return _ended(2, f"error: {_brief(named)}")
    except SimulationError as error:
        return _ended(1, str(error))
    except BrokenPipeError:  # `program` sees to it
        return 0
    except OSError as error:  # the machine can't do it: of what a user named `StorageError` tells
        full = "cannot write to standard output" if error.errno in _FULL else ""
        said = [str(each) for each in (error.filename or full, error.strerror or error) if each]
        return _ended(2, f"error: {': '.join(said)}")
    except Exception as error:
        if library := _refuses_to_load(error):
            return _ended(2, f"error: {library} can't be loaded: {' '.join(str(error).split())}")
        if isinstance(error, ImportError) and error.name is None:  # ours: it says why
            return _ended(2, f"error: {error}")
        raise
    except KeyboardInterrupt as error:
        kept = ""
        if args.resumes and args.output.is_dir():
            kept = f"; what is done is kept in {args.output}, the same command goes on from there"
        code = error.code if isinstance(error, signals.Interrupted) else 130
        return _ended(code, f"interrupted{kept}")


_OURS = "model", "analytic", "mjsim", "compare"


def _refuses_to_load(error: Exception) -> str:
    """The library that raised an error while it was imported, as for what the environment has; else
    nothing."""
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    packages = [frame.f_globals.get("__name__", "").partition(".")[0] for frame in frames]
    first = max(k for k, package in enumerate(packages) if package in _OURS) + 1
    loads = first < len(frames) and frames[first].f_code.co_name == "<module>"
    return packages[first] if loads else ""


def _ended(code: int, said: str) -> int:
    """Say in a line why a command ended with an exit code, and return that."""
    # the name of a file may hold a line's end, or what a terminal obeys
    said = "".join(each if each.isprintable() else ascii(each)[1:-1] for each in said)
    with suppress(OSError):  # nobody reads it any more, as where the terminal is gone
        print(f"dualball: {said}", file=sys.stderr)
    return code


def _run(argv: Sequence[str], args: argparse.Namespace) -> int:
    """Carry out a command, whose arguments are added to `args`."""
    # argparse takes -1e-6 and -inf for options, unlike -1: a space in front makes values of them.
    words = [re.sub(r"^-(?=\.?\d|inf|nan)", " -", word) for word in argv]
    words = [
        re.sub(r"^--[\w-]+", lambda option: option[0].replace("_", "-"), word) for word in words
    ]
    for before, word in itertools.pairwise(["", *words]):
        option = re.fullmatch(r"(--[\w-]+)=\s*", word)
        if option or not word.strip():
            named = option[1] if option else before if before.startswith("-") else "an argument"
            raise InputError(f"{named} is empty")
    words = words or ["--help"]
    if words[0] == "help":
        words = [*words[1:2], "--help"]
    if words == ["--version"]:
        print(f"dualball {version('dualball')}")
        return 0
    from compare.commands import options, parsers  # here, because the version needs none of them

    parsers.parser(words).parse_args(words, args)
    module, _, function = args.run.partition(".")
    run = getattr(importlib.import_module(f"compare.commands.{module}"), function)
    # a page says with what it was written
    args.words = ["dualball", *(word.strip() for word in words)]
    own = hasattr(args, "quiet") or getattr(args, "view", False) or args.run == "look.explore"
    quiet = own or getattr(args, "json", False)
    telling = nullcontext(lambda done: None) if quiet else waiting.told(words[0])
    with (
        warnings.catch_warnings(),
        options.nothing_left(args),
        signals.raised(),
        telling as args.tell,
    ):
        warnings.showwarning = lambda message, *where: options.warn(" ".join(str(message).split()))
        return int(run(args))
