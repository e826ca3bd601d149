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
    from cathxr.study.design import StudyDesign
    from cathxr.study.report.figures_paths import TrialPath

_LIBRARIES = ("statsmodels", "scipy", "numpy", "matplotlib")
_SIMULATED, _TWIN_BOX = "simulated", "digital twin"
"""`TrialRecord.software` of drawn trials, `TrialRecord.box` of those on the twin."""


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
    require_libraries()
    with open_study(folder, store) as study:
        for line in write_report(study, out or folder / "report", recordings):
            click.echo(line)


def write_report(study: StudyAtHand, target: Path, recordings: Path | None) -> list[str]:
    """Return what is to be told after report.html and report.pdf were written into `target`, which is made.

    recordings: where those of the trials are, for the pictures of paths; None without.

    Raises:
        CathxrError: a file cannot be written.
    """
    from cathxr.storage.atomic import check_writable, written_whole
    from cathxr.study.analysis.analyse import analyse
    from cathxr.study.report.compose import Made
    from cathxr.study.report.compose import report as composed
    from cathxr.study.report.html import html
    from cathxr.study.report.pdf import pdf

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
        simulated=_simulated(data.trials),
    )
    analysis = analyse(data)
    document = composed(analysis, made, paths)
    for file, content in zip(files, (html(document).encode(), pdf(document)), strict=True):
        with written_whole(file) as part:
            part.write_bytes(content)
    told = [analysis.primary.model.reading]
    if recordings is not None and without:
        told.append(f"No path of {without} trials: their recordings are not in {recordings}, or hold no Tracks.")
    return [*told, f"Wrote {files[0]} and {files[1].name}."]


def _simulated(trials: tuple[TrialRecord, ...]) -> str:
    """Return in what way the data are simulated, as a sentence; "" where they are not."""
    if any(each.software == _SIMULATED for each in trials):
        return "These data are simulated: no person took part, and the times were drawn."
    if any(each.box == _TWIN_BOX for each in trials):
        return (
            "These data are simulated: no person took part. Simulated hands steered the digital twin, and every trial "
            "was tracked, recorded and measured as a real one is."
        )
    return ""


def require_libraries() -> None:
    """Return when what a report needs is installed.

    Raises:
        ConfigError: it is not.
    """
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
        measures=_measures(study.design, trials),
        changes=[
            f"Version {each.version}, {each.adopted}: {each.reason}"
            for each in study.store.designs()[1:]
            if each.reason
        ],
        seed=0,  # not the allocation's, which stays concealed
    )


def _measures(design: "StudyDesign", trials: tuple[TrialRecord, ...]) -> "dict[str, Measure]":
    """Return the metrics of the catalogue that are outcomes of the design, as measures."""
    from cathxr.study.report_data import measure_of
    from cathxr.training.metrics import METRICS

    return {
        each.key: measure_of(each.key, name=each.name, unit=each.unit, better=each.better, trials=trials)
        for each in METRICS
        if each.key in (design.primary, *design.secondary)
    }


def _paths(trials: tuple[TrialRecord, ...], recordings: Path | None) -> tuple[list["TrialPath"], int]:
    """Return the paths of the trials that count and have a recording, and of how many there is none."""
    if recordings is None:
        return [], 0
    from cathxr.app.study_paths import trial_path
    from cathxr.study.analysis.data import counted

    found, without = [], 0
    for each in counted(trials):
        try:
            path = trial_path(recordings / each.session, each) if each.session else None
        except CathxrError:
            path = None
        if path is None:
            without += 1
        else:
            found.append(path)
    return found, without
