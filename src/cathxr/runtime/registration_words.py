"""What the registration page says: figures, and the advice for each step. Pure functions."""

from cathxr.registration import Kind, Solution
from cathxr.wire.calibration_messages import Figure

_GOOD_MM, _FAIR_MM = 2.0, 4.0


def solution_figures(solution: Solution) -> list[Figure]:
    """Return the figures of a registration, the errors of targets first and the FRE last."""
    found = solution.registration
    figures = [
        _error("Predicted error at the centroid", found.predicted_tre_mm),
        _error("Predicted error at worst", found.worst_tre_mm),
        _error("Held-out error", found.tre_mm),
        Figure(label="Each landmark is known to", value=_mm(found.fle_mm)),
        Figure(label="FRE (not a target error)", value=_mm(found.fre_mm)),
        Figure(label="Degrees of freedom", value=str(solution.spare)),
    ]
    if found.kind is not Kind.RIGID:
        figures.append(Figure(label="Scale", value=f"{found.scale:.3f}"))
    if found.kind is Kind.AFFINE:
        figures.append(Figure(label="Stretch", value=" ".join(f"{each:.2f}" for each in solution.stretch)))
    if found.kind is not Kind.RIGID:
        figures.append(Figure(label="Condition number", value=f"{solution.condition:.1f}"))
    return figures


def missing_sentence(touched: int, kind: Kind) -> str:
    """Return why a registration of a kind cannot be made of so many landmarks; empty: it can."""
    if touched >= kind.fewest_pairs:
        return ""
    return f"{touched} of {kind.fewest_pairs} landmarks that {kind.value} registration takes."


def closing_advice(solution: Solution) -> str:
    """Return what came of it, in one sentence for a person."""
    grave = [each.sentence for each in solution.doubts if each.grave]
    if grave:
        return f"{grave[0]} Choose it in the list to touch it again."
    found = solution.registration
    if found.worst_tre_mm is None:
        return (
            "Registered, but with so few landmarks nothing can be said about the error: touch more of them, or save it "
            "as it is."
        )
    held = "" if found.tre_mm is None else f"; held-out landmarks are {found.tre_mm:.1f} mm off"
    return (
        f"{found.predicted_tre_mm:.1f} mm off are expected at the landmarks' centroid, {found.worst_tre_mm:.1f} mm at "
        f"worst over the heart{held}."
    )


def _error(label: str, value: float | None) -> Figure:
    if value is None:
        return Figure(label=label, value="unknown", level="warn")
    return Figure(
        label=label, value=_mm(value), level="good" if value < _GOOD_MM else "warn" if value < _FAIR_MM else "bad"
    )


def _mm(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2f} mm"
