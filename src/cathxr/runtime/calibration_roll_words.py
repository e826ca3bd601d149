"""What the jig procedure says, and its figures."""

from cathxr.calibration.roll import JigCalibration, changes, counts_per_degree
from cathxr.calibration.roll_rocking import Play
from cathxr.calibration.roll_sentences import number, side_of
from cathxr.core import Roll
from cathxr.wire.calibration_messages import Figure, RollStep

_MUCH_PLAY_DEG = 1.0
_GOOD_CLOSURE_DEG = 1.0


def step_advice(step: RollStep, roll: Roll) -> str:
    """Return what to do in a step, for a person who stands at the handle."""
    side = side_of(roll.zero_direction)
    if step == "zero":
        return (
            f"Slide the transducer into the jig at the far end of the box, turn the gear's mark T {side}, lock, "
            "let go, and confirm."
        )
    if step == "backlash":
        return (
            "Leave the catheter's gear locked and rock the encoder's gear to and fro with a finger, gently, from stop "
            "to stop; then confirm."
        )
    if step == "turn":
        return (
            "Unlock, and turn the handle once round, clockwise as you look from it towards the box, until T points "
            f"{side} again; lock, let go, and confirm."
        )
    return "Leave the handle locked and save, or begin again."


def progress_figures(roll: Roll, play: Play | None, *, is_past_zero: bool) -> list[Figure]:
    """Return what is known while the steps go on."""
    figures = [Figure(label="Handle in the jig", value="confirmed", level="good")] if is_past_zero else []
    if play is not None:
        figures.append(_play(play, counts_per_degree(roll)))
    return figures


def result_figures(before: Roll, result: JigCalibration) -> list[Figure]:
    """Return what was measured, with its errors, and what saving changes."""
    per_degree = counts_per_degree(result.roll)
    figures = [Figure(label="Roll zero", value=f"± {result.zero_std / per_degree:.2f}°")]
    if result.play is not None:
        figures.append(_play(result.play, per_degree))
    if result.turn is not None:
        figures.append(
            Figure(
                label="One turn",
                value=f"{abs(result.turn.counts):.0f} counts",
                level="good" if result.turn.is_as_stated else "bad",
            )
        )
        closes = abs(result.turn.closure_deg) <= _GOOD_CLOSURE_DEG
        figures.append(
            Figure(
                label="It closes within", value=f"{result.turn.closure_deg:+.2f}°", level="good" if closes else "warn"
            )
        )
    for key, (old, new) in changes(before, result.roll).items():
        if key != "backlash_deg":
            was, now = (str(each) if isinstance(each, int) else number(each) for each in (old, new))
            figures.append(Figure(label=key, value=f"{was} → {now}", level="warn"))
    return figures


def _play(play: Play, per_degree: float) -> Figure:
    degrees = play.counts / per_degree
    return Figure(
        label="Backlash",
        value=f"{degrees:.2f} ± {play.counts_std / per_degree:.2f}°",
        level="good" if degrees <= _MUCH_PLAY_DEG else "warn",
    )
