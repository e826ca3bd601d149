"""Estimates with their intervals, and how numbers are told to people."""

import math
from dataclasses import dataclass

from cathxr.study.analysis.data import Measure


@dataclass(frozen=True)
class Estimate:
    """A value and the interval that holds the truth in `level` of all studies. On the model's scale (log or linear)."""

    value: float
    low: float
    high: float
    level: float = 0.95

    @property
    def excludes_zero(self) -> bool:
        """Whether no difference at all lies outside the interval."""
        return self.low > 0.0 or self.high < 0.0

    def scaled(self, factor: float) -> "Estimate":
        """Return this times a positive `factor`."""
        return Estimate(self.value * factor, self.low * factor, self.high * factor, self.level)


def p_text(p: float) -> str:
    """Return a p value as journals print it: three decimals, and never 0."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def p_cell(p: float | None) -> str:
    """Return a p value for a table's cell."""
    return "–" if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"


def number(value: float, digits: int = 3) -> str:
    """Return a number with `digits` significant digits and a true minus sign, without exponents."""
    if value == 0.0 or not math.isfinite(value):
        return "0" if value == 0.0 else "–"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{min(decimals, 6)}f}"
    return text.replace("-", "−")


def percent(share: float) -> str:
    """Return a share as whole per cent."""
    return f"{100.0 * share:.0f} %"


def effect_cell(effect: Estimate, measure: Measure) -> str:
    """Return an effect with its interval: a ratio for a measure on the log scale, else a difference with its unit."""
    if measure.log:
        return f"× {math.exp(effect.value):.2f} ({math.exp(effect.low):.2f} to {math.exp(effect.high):.2f})"
    values = [number(each) for each in (effect.value, effect.low, effect.high)]
    return f"{'+' if effect.value > 0 else ''}{values[0]} ({values[1]} to {values[2]}) {measure.unit}".strip()


def change_text(effect: float, measure: Measure) -> str:
    """Return an effect in words, such as "26 % lower", "4.1 mm higher" or, of counts, "12 % fewer"."""
    less, more = ("fewer", "more") if measure.count else ("lower", "higher")
    if measure.log:
        share = math.expm1(effect)
        return f"{percent(abs(share))} {less if share < 0 else more}"
    return f"{number(abs(effect))} {measure.unit}".strip() + f" {less if effect < 0 else more}"


def range_text(effect: Estimate, measure: Measure) -> str:
    """Return an interval in words: what the data are compatible with."""
    return f"from {change_text(effect.low, measure)} to {change_text(effect.high, measure)}"


def in_sentence(name: str) -> str:
    """Return a measure's name as it stands within a sentence: abbreviations keep their capitals."""
    return name if name[1:2].isupper() or not name[1:2] else name[:1].lower() + name[1:]


def verb_of(name: str) -> str:
    """Return "was", or "were" for a measure whose name is a plural, such as "Virtual wall breaches"."""
    words = name.split(" (")[0].split()
    plural = bool(words) and (words[0] == "Targets" or (words[-1].endswith("s") and words[-1][-2:] not in ("ss", "is")))
    return "were" if plural else "was"


def comparison_reading(
    effect: Estimate, measure: Measure, *, subject: str, reference: str, conclude: bool = True
) -> str:
    """Return in plain words what an effect of `subject` against `reference` says, and what it leaves open.

    conclude: False where the effect is not that of the subject alone; then it is told without a conclusion.
    """
    what = in_sentence(measure.name)
    found = (
        f"With {subject}, {what} {verb_of(measure.name)} {change_text(effect.value, measure)} than with {reference}; "
        f"the data fit anything {range_text(effect, measure)} ({percent(effect.level)} interval)."
    )
    if not conclude:
        return found
    if not effect.excludes_zero:
        return found + " No difference at all is among these, so this study does not settle which is better."
    lower_is = {"lower": "in favour of", "higher": "against", "neither": ""}[measure.better]
    if effect.value > 0.0:
        lower_is = {"in favour of": "against", "against": "in favour of", "": ""}[lower_is]
    return found + (f" This speaks {lower_is} {subject}." if lower_is else " No difference at all is not among these.")
