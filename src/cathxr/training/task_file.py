"""Reads and writes task files, TOML. Format: docs/tasks.md.

Training reads them itself, as the other middle packages read their own files: a reader in storage could not know a
Task, since the middle packages do not import each other.
"""

import hashlib
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from cathxr.core import ConfigError, DataError
from cathxr.core.plain_text import plain_text_fault
from cathxr.training.task import Place, Plane, Practice, Reach, Target, Task

SCHEMA = "cathxr-task/1"
_LARGEST = 1_000_000


def _name(text: str) -> str:
    fault = plain_text_fault(text, longest=80)
    if fault is not None:
        raise ValueError(fault)
    return text


def _text(text: str) -> str:
    fault = plain_text_fault(text, lines=True)
    if fault is not None:
        raise ValueError(fault)
    return text


_Name = Annotated[str, AfterValidator(_name)]
_Text = Annotated[str, AfterValidator(_text)]
_Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")]
_Vector = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
_Positive = Annotated[FiniteFloat, Field(gt=0.0)]
_Degrees = Annotated[FiniteFloat, Field(gt=0.0, le=180.0)]
_Seconds = Annotated[FiniteFloat, Field(ge=0.0)]
_Limit = Annotated[FiniteFloat, Field(gt=0.0, le=86_400.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Place(_Table):
    landmark: _Key | None = None
    landmarks: Annotated[list[_Key], Field(min_length=1)] | None = None
    position_ct_mm: _Vector | None = None
    position_box_mm: _Vector | None = None


class _Reach(_Table):
    by: Literal["tip", "beam"]
    radius_mm: _Positive
    angle_deg: _Degrees | None = None
    dwell_s: _Seconds = 0.0
    direction_box: _Vector | None = None
    range_mm: _Positive | None = None


class _Plane(_Table):
    offset_mm: _Positive
    angle_deg: _Degrees
    up_deg: _Degrees = 30.0
    dwell_s: _Seconds = 0.0
    axis: Annotated[list[_Key], Field(min_length=2, max_length=2)] | None = None
    normal_box: _Vector | None = None
    up_box: _Vector | None = None
    range_mm: _Positive | None = None


class _Target(_Table):
    key: _Key
    name: _Name
    place: _Place
    reach: _Reach | None = None
    plane: _Plane | None = None


class _Practice(_Table):
    in_a_row: Annotated[int, Field(ge=1, le=1000)] = 3
    limit_s: _Limit


class _Document(_Table):
    schema_name: Literal["cathxr-task/1"] = Field(alias="schema")
    key: _Key
    name: _Name
    text: _Text
    view: Literal["2d", "3d", "free"] = "free"
    order: Literal["fixed", "random", "latin"] = "fixed"
    limit_s: _Limit
    target_limit_s: _Limit | None = None
    draw: Annotated[int, Field(ge=1)] | None = None
    step: Annotated[int, Field(ge=1, le=9)] | None = None
    practice: _Practice | None = None
    targets: Annotated[list[_Target], Field(min_length=1, max_length=1000)]


def read_task(path: Path | str) -> Task:
    """Return the task in the file at `path`.

    Raises:
        DataError: the file cannot be read.
        ConfigError: it is not TOML, or a key is missing, unknown, or has a value it cannot have.
    """
    return task_from_text(task_text(path), name=str(path))


def task_text(path: Path | str) -> str:
    """Return the text of a task file.

    Raises:
        DataError: the file cannot be read; ConfigError: it is not text.
    """
    file = Path(path)
    try:
        raw = file.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise DataError(
            f"{file} cannot be read ({reason}); give a task file, or a key of `cathxr tasks list`."
        ) from error
    if len(raw) > _LARGEST:
        raise ConfigError(f"{file} is larger than 1 MB, which no task is; check that it is the right file.")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(f"{file} is not UTF-8 text; save it as UTF-8.") from error


def task_from_text(text: str, *, name: str) -> Task:
    """Return the task that a file's text describes; `name` is the file's name in the sentences.

    Raises:
        ConfigError: see `read_task`.
    """
    try:
        return _task(_Document.model_validate(tomllib.loads(text)))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"{name} is not valid TOML: {error}.") from error
    except ValidationError as error:
        raise ConfigError(f"{name}: {_first_fault(error)}. The format is in docs/tasks.md.") from error
    except ValueError as error:
        raise ConfigError(f"{name}: {error}. The format is in docs/tasks.md.") from error


def task_toml(task: Task) -> str:
    """Return the text of the task file that reads back as `task`; what is not said is left out."""
    document = {
        "schema": SCHEMA,
        "key": task.key,
        "name": task.name,
        "text": task.text,
        "view": task.view,
        "order": task.order,
        "limit_s": task.limit_s,
        "target_limit_s": task.target_limit_s,
        "draw": task.draw,
        "step": task.step,
        "practice": None if task.practice is None else dict(vars(task.practice)),
        "targets": [_target_table(each) for each in task.targets],
    }
    return tomli_w.dumps(_present(document))


def task_sha256(task: Task) -> str:
    """Return the SHA-256 of what a task says, hexadecimal: the same for files that differ in their layout only."""
    return hashlib.sha256(task_toml(task).encode("utf-8")).hexdigest()


def _task(document: _Document) -> Task:
    practice = document.practice
    return Task(
        key=document.key,
        name=document.name,
        text=document.text,
        targets=tuple(_target(each) for each in document.targets),
        limit_s=document.limit_s,
        view=document.view,
        order=document.order,
        target_limit_s=document.target_limit_s,
        draw=document.draw,
        step=document.step,
        practice=None if practice is None else Practice(practice.in_a_row, practice.limit_s),
    )


def _target(table: _Target) -> Target:
    """Return a target, its key named where something is wrong."""
    try:
        if (table.reach is None) == (table.plane is None):
            raise ValueError("expected either reach or plane")
        if table.place.landmark is not None and table.place.landmarks is not None:
            raise ValueError("place: expected landmark or landmarks, got both")
        one = table.place.landmark
        place = Place(
            landmarks=(one,) if one is not None else tuple(table.place.landmarks or ()),
            position_ct_mm=_array(table.place.position_ct_mm),
            position_box_mm=_array(table.place.position_box_mm),
        )
        return Target(table.key, table.name, place, _rule(table))
    except ValueError as error:
        raise ValueError(f"target {table.key}: {error}") from error


def _rule(table: _Target) -> Reach | Plane:
    if table.reach is not None:
        reach = table.reach
        return Reach(
            reach.by,
            reach.radius_mm,
            reach.angle_deg,
            reach.dwell_s,
            direction_box=_array(reach.direction_box),
            range_mm=reach.range_mm,
        )
    plane = table.plane
    assert plane is not None
    return Plane(
        plane.offset_mm,
        plane.angle_deg,
        plane.dwell_s,
        plane.up_deg,
        axis=None if plane.axis is None else (plane.axis[0], plane.axis[1]),
        normal_box=_array(plane.normal_box),
        up_box=_array(plane.up_box),
        range_mm=plane.range_mm,
    )


def _target_table(target: Target) -> dict[str, Any]:
    place, rule = target.place, target.rule
    where: dict[str, Any] = {"position_ct_mm": place.position_ct_mm, "position_box_mm": place.position_box_mm}
    if len(place.landmarks) == 1:
        where["landmark"] = place.landmarks[0]
    elif place.landmarks:
        where["landmarks"] = list(place.landmarks)
    kind = "reach" if isinstance(rule, Reach) else "plane"
    return {"key": target.key, "name": target.name, "place": _present(where), kind: _present(dict(vars(rule)))}


def _array(values: list[float] | None) -> Any:
    return None if values is None else np.array(values, dtype=np.float64)


def _present(table: dict[str, Any]) -> dict[str, Any]:
    """Return the table without what is absent, arrays and tuples as lists."""
    listed = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in table.items()}
    return {
        name: list(value) if isinstance(value, tuple) else value for name, value in listed.items() if value is not None
    }


def _first_fault(error: ValidationError) -> str:
    """Return the first fault that a document was found to have, with the key it is at."""
    first = error.errors(include_url=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"{where} is missing"
    if first["type"] == "extra_forbidden":
        return f"{where} is not a key of this format; take it out"
    if first["type"] == "value_error":
        return f"{where} is wrong: {first['ctx']['error']}"
    return f"{where} is wrong: {first['msg']} (found {first['input']!r:.60})"
