"""What live training is made of, from the options of `cathxr run`: tasks, study, store, the heart's walls."""

import os
import sys
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path

from cathxr import __version__
from cathxr.app.config import Config
from cathxr.app.heart_registration import registration_of
from cathxr.app.live_parts import LiveParts
from cathxr.app.register_heart import chosen_heart
from cathxr.app.study_folder import now, open_study, place_of, stores_module
from cathxr.app.wall_process import wall_depth_elsewhere
from cathxr.core import ConfigError, DataError, Roi
from cathxr.heart import HeartFolder
from cathxr.registration import Registration
from cathxr.runtime.training_nouns import Store, StudyHere, TaskHere, TrainingParts
from cathxr.storage.atomic import os_reason
from cathxr.training import Task, builtin_tasks, place_task, read_task, task_sha256

OWN_KEY = "training"
OWN_FILE = "training.sqlite"
_TASKS = "tasks"


def training_parts(live: LiveParts, config: Config, *, study: Path | None, store: str | None) -> TrainingParts:
    """Return what training is made of. study: a study's folder; store: a file or an address, None: the usual one.

    Raises:
        CathxrError: the study cannot be opened.
    """
    heart_path = Path(config.heart) if config.heart else None
    heart = chosen_heart(heart_path)
    registration = registration_of(heart)
    here = None if study is None else study_here(study, store)
    recorded = live.options.open_session is not None
    tasks = builtin_tasks() if study is None or here is None else _study_tasks(study, here)
    return TrainingParts(
        tasks=tuple(_placed(each, heart, registration, live.rig.roi) for each in tasks),
        open_store=_own_opener(store) if study is None or here is None else _study_opener(study, store, here.key),
        utc=now,
        new_id=lambda: uuid.uuid4().hex[:12],
        recordings=str(config.recording.folder) if recorded else "",
        software=__version__,
        box=live.rig.name,
        key=OWN_KEY if here is None else here.key,
        study=here,
        has_store=here is not None or store is not None or own_file().is_file(),
        no_recording="" if recorded else live.options.no_recording,
        depth=lambda: wall_depth_elsewhere(heart_path),
    )


def study_here(folder: Path, store: str | None) -> StudyHere:
    """Return the study of a folder, its store looked into once.

    Raises:
        CathxrError: something of it is missing or wrong.
    """
    with open_study(folder, store) as found:
        return StudyHere(found.design.key, found.design, found.surveys)


def own_file(platform: str = sys.platform, environment: Mapping[str, str] = os.environ) -> Path:
    """Return where trials outside a study are stored: in this user's folder for data (not created here)."""
    if platform == "win32":
        base = environment.get("LOCALAPPDATA")
        folder = Path(base) if base else Path.home() / "AppData" / "Local"
    elif platform == "darwin":
        folder = Path.home() / "Library" / "Application Support"
    else:
        # The XDG rules: a relative path is to be ignored.
        base = environment.get("XDG_DATA_HOME")
        folder = Path(base) if base and Path(base).is_absolute() else Path.home() / ".local" / "share"
    return folder / "cathxr" / OWN_FILE


def _study_opener(folder: Path, store: str | None, key: str) -> Callable[[], Store]:
    return lambda: stores_module().open(place_of(folder, store), study=key)


def _own_opener(place: str | None) -> Callable[[], Store]:
    """Return what opens one's own store; it is made where it is not there yet."""

    def opened() -> Store:
        module, chosen = stores_module(), place
        if chosen is None:
            file = own_file()
            try:
                file.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise DataError(
                    f"{file.parent}: cannot be made ({os_reason(error)}); give a store with --store."
                ) from error
            chosen = str(file)
        return module.create(chosen, study=OWN_KEY, seed=0, software=__version__, at=now())

    return opened


def _study_tasks(folder: Path, here: StudyHere) -> list[Task]:
    """Return the tasks that a study's design names, those of its folder before the built-in ones."""
    practice = here.design.practice
    keys = list(dict.fromkeys([*(() if practice is None else (practice.task,)), *here.design.tasks]))
    builtin = {each.key: each for each in builtin_tasks()}
    tasks = []
    for key in keys:
        own = folder / _TASKS / f"{key}.toml"
        task = read_task(own) if own.is_file() else builtin.get(key)
        if task is None:
            raise ConfigError(f"{folder}: no task {key}, which the design names; put {key}.toml into its folder tasks.")
        tasks.append(task)
    return tasks


def _placed(task: Task, heart: HeartFolder, registration: Registration, roi: Roi) -> TaskHere:
    try:
        placed = place_task(
            task, ct_from_box=registration.matrix, points_ct=heart.points_ct, roi=roi, sha256=task_sha256(task)
        )
    except ConfigError as error:
        return TaskHere(task, None, str(error))
    return TaskHere(task, placed)
