"""Shows what is stored: ``figures``, ``inspect``, ``compare``, ``render``; and ``explore``."""

import argparse
from pathlib import Path

from compare import testing
from compare.commands import options
from compare.figures import drawing
from compare.view import collection, motions
from model import InputError, storage, table
from model.parameters import check_names


def figures(args: argparse.Namespace) -> int:
    from compare import validation  # here, because drawing takes a second to load
    from compare.report import gallery as registry
    from compare.report import results

    if args.results:
        results.load(args.results)  # else there would be figures without what was measured
    if own := list(options.own_set(args).values()):
        chosen = registry.of_set(*own)
        options.warn_of_model(*own)
    else:
        chosen = registry.of_results(validation.stored_evidence(args.results or Path("results")))
    if args.figure:
        check_names(args.figure, list(chosen), "figure")
        chosen = {name: chosen[name] for name in args.figure}
    formats, gaps = list(dict.fromkeys(args.format or ["svg"])), list[str]()
    for k, (name, gap) in enumerate(registry.write(args.output, chosen, formats), 1):
        args.tell(k / len(chosen))
        gaps += [f"{name}: {gap}"] if gap else []
        for suffix in () if gap else formats:
            print(f"{args.output / name}.{suffix}: written")
    if args.figure and len(gaps) == len(chosen):
        raise InputError("; ".join(gaps))
    print("\n".join(gaps), end="\n" * bool(gaps))
    return 0


def inspect(args: argparse.Namespace) -> int:
    if args.claim:
        return _chain(args)
    if args.file is None:
        raise InputError(
            "inspect needs the file of a run, or --claim; see 'dualball inspect --help'"
        )
    if gathered := collection.read(args.file):
        if args.plot:
            drawing.save(collection.draw(gathered), args.plot)
        if args.table:
            table.write(args.table, collection.labelled(gathered))
        told = collection.describe(gathered)
        options.show(told, args.json, collection.shown(told))
        return 0
    if args.plot:
        drawing.save(motions.draw(storage.load(args.file)), args.plot)
    if args.table:
        table.write(args.table, motions.labelled(storage.load(args.file)), args.tell)
    about = motions.describe(args.file)
    options.show(about, args.json, motions.table(about))
    return 0


def _chain(args: argparse.Namespace) -> int:
    from compare import validation  # here, because it loads everything there is
    from compare.report import chain, results

    if args.file:
        results.load(args.file)  # else the chain would end without numbers, and not say why
    claim, verdict, summary = validation.told(args.claim, args.file or Path("results"))
    found = chain.links(claim, verdict, summary)
    options.show(chain.described(found), args.json, *chain.shown(found))
    return 0


def compare(args: argparse.Namespace) -> int:
    if args.b is None:
        from compare.commands import measured  # here, because two motions need no theory

        return measured.run(args)
    if args.set or args.parameters:
        raise InputError("--set and --parameters are for a measured curve, without OTHER")
    a, b = testing.read(args.a), testing.read(args.b)
    about = motions.compared(a, b)
    if args.plot:
        drawing.save(motions.draw_both(a, b), args.plot)
    options.show(about, args.json, *motions.compared_tables(about))
    return 0


def render(args: argparse.Namespace) -> int:
    from compare.view import page  # here, because drawing takes a second to load

    asked = {name: getattr(args, name) for name in ("at", "time", "speed", "rate")}
    asked = {name: value for name, value in asked.items() if value is not None}
    print(page.save(storage.load(args.file), args.output, **asked))
    return 0


def explore(args: argparse.Namespace) -> int:
    from compare.view import explore as served  # here, because nothing else needs it

    served.serve(options.parameters(args), args.port, not args.no_browser)
    # it ends by a signal alone, which the server's loop keeps to itself now and then
    raise KeyboardInterrupt
