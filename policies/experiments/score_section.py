"""The report's section on policies: sentences, a dot-and-whisker plot and a table."""

from collections.abc import Iterator, Mapping
from html import escape

from policies.play.evaluation import Scores
from teasim.common.statistics import Rate

ScoresBySet = Mapping[str, Mapping[str, Scores]]
"""Training set -> mode -> scores; the others are compared with the first training set."""

ROW = 26
"""Height of a row of the plot [px]."""
LABELS = 300
"""Width of the plot's labels [px]."""
AXIS = 400
"""Width of the plot's axis, 0 to 100 % [px]."""
COLOURS = ("#b4552d", "#2f6f8f", "#5a7d3a")
"""Colours of the training sets, CSS."""


def score_section(scores: ScoresBySet) -> str:
    """Render `scores` as self-contained HTML."""
    words = "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences(scores))
    return f"{words}\n{_plot(scores)}\n{_table(scores)}"


def sentences(scores: ScoresBySet) -> list[str]:
    """Write, per mode, how the policy accuracy changed when demonstrations were left out."""
    base, *others = scores
    found = [
        _compare(mode, base, scores[base][mode].policy_accuracy, name, other.policy_accuracy)
        for name in others
        for mode, other in scores[name].items()
    ]
    return found or [f"Only one policy was trained, on {base}: there is nothing to compare."]


def _compare(mode: str, base: str, before: Rate, name: str, after: Rate) -> str:
    change = 100 * (after.value - before.value)
    numbers = f"policy accuracy {after} {name}, {before} on {base}"
    if abs(change) < 0.05:
        verdict = "no difference"
    elif after.low > before.high or after.high < before.low:
        verdict = f"{abs(change):.1f} points {'better' if change > 0 else 'worse'}"
    else:
        direction = "better" if change > 0 else "worse"
        verdict = (
            f"{abs(change):.1f} points {direction}, but the intervals overlap: "
            "more episodes are needed to tell"
        )
    return f"With {mode} decisions: {numbers}; {verdict}."


def _rows(scores: ScoresBySet) -> Iterator[tuple[int, str, Scores]]:
    """Yield (number of the training set, label, scores), mode by mode."""
    modes = next(iter(scores.values()))
    for mode in modes:
        for number, (name, by_mode) in enumerate(scores.items()):
            yield number, f"{name}, {mode}", by_mode[mode]


def _plot(scores: ScoresBySet) -> str:
    rows = list(_rows(scores))
    height = ROW * len(rows)
    marks = [_tick(percent, height) for percent in range(0, 101, 20)]
    marks += [
        _whisker(y, COLOURS[number % len(COLOURS)], label, s.policy_accuracy)
        for y, (number, label, s) in zip(range(ROW // 2, height, ROW), rows, strict=True)
    ]
    return (
        f'<svg viewBox="0 0 {LABELS + AXIS + 30} {height + 40}" role="img" width="100%" '
        'style="max-width:760px" font-family="sans-serif" font-size="12" fill="currentColor" '
        'aria-label="Policy accuracy with 95 % intervals">'
        + "".join(marks)
        + f'<text x="{LABELS + AXIS / 2}" y="{height + 36}" text-anchor="middle">'
        "policy accuracy [%], 95 % interval</text></svg>"
    )


def _tick(percent: int, height: int) -> str:
    x = LABELS + AXIS * percent / 100
    return (
        f'<line x1="{x}" x2="{x}" y1="0" y2="{height}" stroke="currentColor" opacity="0.15"/>'
        f'<text x="{x}" y="{height + 16}" text-anchor="middle">{percent}</text>'
    )


def _whisker(y: int, colour: str, label: str, rate: Rate) -> str:
    low, high = (LABELS + AXIS * bound for bound in (rate.low, rate.high))
    text = f'<text x="{LABELS - 10}" y="{y + 4}" text-anchor="end">{escape(label)}</text>'
    if not rate.trials:
        return text
    return (
        f"<g><title>{escape(f'{label}: {rate}')}</title>{text}"
        f'<line x1="{low:.1f}" x2="{high:.1f}" y1="{y}" y2="{y}" stroke="{colour}" '
        f'stroke-width="2"/><circle cx="{LABELS + AXIS * rate.value:.1f}" cy="{y}" r="5" '
        f'fill="{colour}"/></g>'
    )


def _table(scores: ScoresBySet) -> str:
    """Render all rates, with a column for each kind of violation in the environment's words."""
    rows = list(_rows(scores))
    kinds = list(dict.fromkeys(kind for _, _, s in rows for kind in s.violations))
    heads = ("trained on, decisions", "policy accuracy", "lenient", "goal reached", *kinds)
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = "".join(f"<tr>{_cells(label, s, kinds)}</tr>" for _, label, s in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cells(label: str, scores: Scores, kinds: list[str]) -> str:
    rates = (scores.policy_accuracy, scores.lenient_accuracy, scores.success)
    violations = (scores.violations.get(kind, "never") for kind in kinds)
    texts = (label, *map(str, rates), *map(str, violations))
    return "".join(f"<td>{escape(text)}</td>" for text in texts)
