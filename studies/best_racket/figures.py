"""Draws the trade-off between ball speed and load on the hand."""

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure


def trade_off_figure(rows: Sequence[Mapping[str, float | str]], variables: Sequence[str]) -> Figure:
    """Ball speed over peak force, and what the designs are made of."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    first, designs = rows[0], rows[1:]
    force, speed = "peak force on hand [N]", "ball speed [m/s]"
    left.plot([r[force] for r in designs], [r[speed] for r in designs], "o-", label="best designs")
    left.plot([first[force]], [first[speed]], "s", color="0.4", label="as it starts")
    for r in designs:
        left.annotate(
            f"{r['bound']}", (r[force], r[speed]), xytext=(4, -12), textcoords="offset points"
        )
    left.set(xlabel="peak force on the hand (N)", ylabel="ball speed (m/s)")
    left.set_title("The fastest ball for a bound on the hand's load", fontsize=10)
    left.legend(frameon=False)
    left.grid(alpha=0.3)
    masses = [name for name in variables if name.endswith("[g]")]
    places = range(len(rows))
    base = [0.0] * len(rows)
    for name in masses:
        heights = [float(r[name]) for r in rows]
        right.bar(places, heights, bottom=base, label=name.removesuffix(" [g]"), width=0.6)
        base = [b + h for b, h in zip(base, heights, strict=True)]
    right.set_xticks(list(places), [str(r["bound"]) for r in rows])
    right.set(xlabel="bound on the peak force", ylabel="added mass (g)")
    right.set_ylim(0.0, 1.35 * max(base))
    for i, r in enumerate(rows):
        text = "\n".join(
            f"{short} {float(r[name]):.0f} %"
            for name, short in (("tension [%]", "T"), ("frame stiffness [%]", "k"))
        )
        right.annotate(
            text, (i, base[i]), ha="center", va="bottom", fontsize=8, xytext=(0, 2),
            textcoords="offset points",
        )  # fmt: skip
    right.set_title("Where mass goes; tension T and frame stiffness k", fontsize=10)
    right.legend(frameon=False, fontsize=8)
    return figure
