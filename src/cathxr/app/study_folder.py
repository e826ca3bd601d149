"""What every `cathxr study` command begins with: the folder, its design and surveys, and the store."""

import datetime
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from cathxr.app.page_options import PATH
from cathxr.core import ConfigError, DataError
from cathxr.core.participant_code import participant_code_fault
from cathxr.study.design import StudyDesign
from cathxr.study.design_file import design_from_text
from cathxr.study.surveys import Survey, builtin_surveys, survey_from_text

if TYPE_CHECKING:
    from cathxr.storage.study_store import StudyStore

DESIGN_FILE = "study.toml"
STORE_FILE = "study.sqlite"
STORE_VARIABLE = "CATHXR_STUDY_STORE"
WIDTH = 110
_SURVEYS = "surveys"
_LARGEST = 1_000_000
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class StudyAtHand:
    """An open study. design_text: study.toml's, as it was adopted."""

    folder: Path
    design: StudyDesign
    design_text: str
    surveys: Mapping[str, Survey]
    store: "StudyStore"

    def survey(self, key: str) -> Survey:
        """Return the survey of a key.

        Raises:
            ConfigError: there is none.
        """
        if key not in self.surveys:
            raise ConfigError(f"No survey {key}; there are {', '.join(self.surveys)}.")
        return self.surveys[key]


def study_options(command: Function) -> Function:
    """Give a command --study and --store."""
    store = click.option("--store", envvar=STORE_VARIABLE, help=f"The store: a file or postgresql://…  [default: {STORE_FILE} in the folder]")  # fmt: skip  # noqa: E501
    folder = click.option("--study", "folder", type=PATH, default=Path("."), help="The study's folder.  [default: .]")
    return folder(store(command))


@contextmanager
def open_study(folder: Path, store: str | None) -> Iterator[StudyAtHand]:
    """Open the study of a folder whose design was adopted.

    Raises:
        CathxrError: something of it is missing or wrong, or study.toml was changed since it was adopted.
    """
    text = design_text(folder)
    design = design_from_text(text, name=str(folder / DESIGN_FILE))
    surveys = surveys_of(folder)
    check_surveys(design, surveys)
    stores = stores_module()
    with stores.open(place_of(folder, store), study=design.key) as opened:
        designs = opened.designs()
        if not designs or designs[-1].text != text:
            raise ConfigError(
                f"{folder / DESIGN_FILE} is not the design that was adopted; give `cathxr study init {folder}` to "
                "adopt it, or put it back as it was."
            )
        yield StudyAtHand(folder, design, text, surveys, opened)


def stores_module() -> "type[StudyStore]":
    """Return the class of study stores.

    Raises:
        ConfigError: what it needs is not installed.
    """
    try:
        from cathxr.storage.study_store import StudyStore
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("cathxr"):
            raise
        raise ConfigError(f"Studies need {error.name}, which is not installed: pip install 'cathxr[study]'.") from error
    return StudyStore


def place_of(folder: Path, store: str | None) -> str:
    """Return where a study's store is."""
    return store or str(folder / STORE_FILE)


def design_text(folder: Path) -> str:
    """Return study.toml of a folder.

    Raises:
        ConfigError: there is none that can be read.
    """
    file = folder / DESIGN_FILE
    if not file.is_file():
        raise ConfigError(f"{file}: no such file; make a study with `cathxr study init {folder}`, or give --study.")
    return read_small(file)


def surveys_of(folder: Path) -> dict[str, Survey]:
    """Return the surveys by key: the built-in ones, and the folder's own in surveys/*.toml, which come before those.

    Raises:
        ConfigError: one of the folder's is wrong.
    """
    found = {each.key: each for each in builtin_surveys()}
    files: dict[str, Path] = {}
    for path in sorted((folder / _SURVEYS).glob("*.toml")):
        survey = survey_from_text(read_small(path), name=str(path))
        if survey.key in files:
            raise ConfigError(f"{path}: key: expected one of its own, got that of {files[survey.key]}; change one.")
        files[survey.key] = path
        found[survey.key] = survey
    return found


def check_surveys(design: StudyDesign, surveys: Mapping[str, Survey]) -> None:
    """Return when there is every survey that a design asks.

    Raises:
        ConfigError: there is not.
    """
    for plan in design.surveys:
        if plan.survey not in surveys:
            raise ConfigError(
                f"{DESIGN_FILE}: no survey {plan.survey}; there are {', '.join(surveys)}, and own ones are put "
                f"into the folder {_SURVEYS}."
            )


def read_small(path: Path) -> str:
    """Return the text of a file of at most 1 MB.

    Raises:
        ConfigError: it cannot be read as UTF-8 text.
    """
    try:
        if path.stat().st_size > _LARGEST:
            raise ConfigError(f"{path}: expected a small text file, got over 1 MB; check the path.")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); check the path.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: expected UTF-8 text; save it as UTF-8.") from error


def checked_code(code: str) -> str:
    """Return a participant's code in capitals.

    Raises:
        ConfigError: it is none; the sentence says why.
    """
    upper = code.strip().upper()
    fault = participant_code_fault(upper)
    if fault is not None:
        raise ConfigError(f"Participant code: {fault}.")
    return upper


def require_enrolled(study: StudyAtHand, code: str) -> None:
    """Return when a participant is enrolled.

    Raises:
        DataError: not so.
    """
    if all(each.code != code for each in study.store.participants()):
        raise DataError(
            f"No participant {code} in study {study.design.key}; give `cathxr study allocate {code}` first."
        )


def now() -> str:
    """Return the instant in UTC, ISO 8601."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def is_there(path: Path) -> bool:
    """Return whether there is anything at a path, a link that leads nowhere included."""
    return os.path.lexists(path)
