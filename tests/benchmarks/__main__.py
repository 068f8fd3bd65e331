"""``python -m tests.benchmarks``: speed, as ratios within one run.

They depend less on the machine and its load than times do.
"""

from rich.console import Console

from analytic import stable_solutions
from compare.kit import pages
from tests.benchmarks import campaigns, loop


def main() -> None:
    """Measure the loop over bare steps, alone and in a batch; then campaigns. Show it as a table."""
    (state,) = stable_solutions(campaigns.SLIPPING)
    rows = [["", "bare mj_step", "whole loop", "ratio"]]
    for name, runs in (("one simulation", 1), (f"batch of {campaigns.BATCH}", campaigns.BATCH)):
        bare, whole, ratio = loop.cost(campaigns.SLIPPING, state.x.tolist(), runs)
        rows.append([name, f"{1e6 * bare:.2f} µs", f"{1e6 * whole:.2f} µs", f"{ratio:.2f}"])
    Console().print(pages.table("Cost of the study's loop", [*rows, *campaigns.rows()]))


if __name__ == "__main__":
    main()
