"""`cathxr study report`: the statistics of a study, as one HTML page and a PDF."""

import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cathxr import __version__
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.study_folder import StudyAtHand, now, open_study, study_options
from cathxr.core import CathxrError, ConfigError
from cathxr.core.trials import TrialRecord

if TYPE_CHECKING:
    from cathxr.study.analysis.data import Measure, StudyData
    from cathxr.study.report.figures_paths import TrialPath

_LIBRARIES = ("statsmodels", "scipy", "numpy", "matplotlib")
_SIMULATED = "simulated"


@click.command("report")
@study_options
@click.option("--out", type=PATH, help="The folder for report.html and report.pdf.  [default: report in the study's]")
@click.option("--recordings", type=PATH, help="Where the recordings of the trials are, for the pictures of paths.")
@told_in_a_sentence
def report(folder: Path, store: str | None, out: Path | None, recordings: Path | None) -> None:
    """Write report.html and report.pdf: participants, times, models, exact tests, learning, surveys, in plain words.

    \b
    Examples:
      cathxr study report --study my_study
      cathxr study report --study my_study --recordings recordings/ --out reports/today
    """
    _require_libraries()
    with open_study(folder, store) as study:
        from cathxr.storage.atomic import check_writable, written_whole
        from cathxr.study.analysis.analyse import analyse
        from cathxr.study.report.compose import Made
        from cathxr.study.report.compose import report as composed
        from cathxr.study.report.html import html
        from cathxr.study.report.pdf import pdf

        target = out or folder / "report"
        target.mkdir(parents=True, exist_ok=True)
        files = (target / "report.html", target / "report.pdf")
        for file in files:
            check_writable(file, what="the report")
        data = _data(study)
        paths, without = _paths(data.trials, recordings)
        made = Made(
            now(),
            __version__,
            (*((name, version(name)) for name in _LIBRARIES), ("Python", platform.python_version())),
            question=study.design.question,
            simulated=any(each.software == _SIMULATED for each in data.trials),
        )
        analysis = analyse(data)
        document = composed(analysis, made, paths)
        for file, content in zip(files, (html(document).encode(), pdf(document)), strict=True):
            with written_whole(file) as part:
                part.write_bytes(content)
    click.echo(analysis.primary.model.reading)
    if recordings is not None and without:
        click.echo(f"No path of {without} trials: their recordings are not in {recordings}, or hold no Tracks.")
    click.echo(f"Wrote {files[0]} and {files[1].name}.")


def _require_libraries() -> None:
    try:
        import jinja2
        import reportlab
        import statsmodels
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"The report needs {error.name}, which is not installed: pip install 'cathxr[study]'."
        ) from error
    del jinja2, reportlab, statsmodels


def _data(study: StudyAtHand) -> "StudyData":
    from cathxr.study.report_data import study_data

    trials = study.store.trials()
    return study_data(
        study.design,
        participants=study.store.participants(),
        trials=trials,
        answers=study.store.answers(),
        surveys=study.surveys,
        measures=_measures(trials),
        changes=[
            f"Version {each.version}, {each.adopted}: {each.reason}"
            for each in study.store.designs()[1:]
            if each.reason
        ],
        seed=0,  # not the allocation's, which stays concealed
    )


def _measures(trials: tuple[TrialRecord, ...]) -> "dict[str, Measure]":
    """Return every metric of the catalogue as a measure."""
    from cathxr.study.report_data import measure_of
    from cathxr.training.metrics import METRICS

    return {
        each.key: measure_of(each.key, name=each.name, unit=each.unit, better=each.better, trials=trials)
        for each in METRICS
    }


def _paths(trials: tuple[TrialRecord, ...], recordings: Path | None) -> tuple[list["TrialPath"], int]:
    """Return the paths of the trials that count and have a recording, and of how many there is none."""
    if recordings is None:
        return [], 0
    from cathxr.app.study_paths import trial_paths
    from cathxr.study.analysis.data import counted

    found, without = [], 0
    sessions: dict[str, list[TrialRecord]] = {}
    for each in counted(trials):
        sessions.setdefault(each.session, []).append(each)
    for session, of_it in sessions.items():
        try:
            paths = trial_paths(recordings / session, of_it) if session else []
        except CathxrError:
            paths = []
        found += paths
        without += len(of_it) - len(paths)
    return found, without
