"""The tables of a study store. A row says which study it is of; a trial is one row, its measures and targets JSON."""

from typing import Any

from sqlalchemy import (
    Boolean,
    Column,
    Double,
    ForeignKeyConstraint,
    Identity,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
)  # fmt: skip

VERSION = 1
"""Raised with every change of the tables: opening.py refuses every other one."""

METADATA = MetaData()

STORE = Table(
    "cathxr_store", METADATA,
    Column("id", Integer, primary_key=True, autoincrement=False),
    Column("version", Integer, nullable=False),
    Column("software", String(64), nullable=False),
    Column("created", String(40), nullable=False),
)  # fmt: skip

STUDY = Table(
    "cathxr_study", METADATA,
    Column("key", String(64), primary_key=True),
    Column("seed", String(40), nullable=False),
    Column("created", String(40), nullable=False),
)  # fmt: skip

DESIGN = Table(
    "cathxr_design", METADATA,
    Column("study", String(64), primary_key=True),
    Column("version", Integer, primary_key=True, autoincrement=False),
    Column("text", Text, nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("reason", Text, nullable=False),
    Column("adopted", String(40), nullable=False),
    ForeignKeyConstraint(["study"], ["cathxr_study.key"]),
)  # fmt: skip

PARTICIPANT = Table(
    "cathxr_participant", METADATA,
    Column("study", String(64), primary_key=True),
    Column("code", String(16), primary_key=True),
    Column("sequence", Text, nullable=False),
    Column("group", String(64), nullable=False),
    Column("joined", String(40), nullable=False),
    ForeignKeyConstraint(["study"], ["cathxr_study.key"]),
)  # fmt: skip

DRAW = Table(
    "cathxr_draw", METADATA,
    Column("study", String(64), primary_key=True),
    Column("group", String(64), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("sequence", Text, nullable=False),
    Column("participant", String(16), nullable=False),
    Column("drawn", String(40), nullable=False),
    ForeignKeyConstraint(["study"], ["cathxr_study.key"]),
)  # fmt: skip


def _trial_columns() -> tuple[Column[Any], ...]:
    """Return what a trial that has begun and one that has ended have in common."""
    columns: tuple[Column[Any], ...] = (
        Column("study", String(64), primary_key=True),
        Column("id", String(64), primary_key=True),
        Column("participant", String(16), nullable=False),
        Column("task", String(64), nullable=False),
        Column("condition", String(64), nullable=False),
        Column("number", Integer, nullable=False),
        Column("period", Integer, nullable=False),
        Column("began", String(40), nullable=False),
        Column("practice", Boolean(create_constraint=False), nullable=False),
        Column("session", Text, nullable=False),
        Column("box", String(128), nullable=False),
        Column("software", String(64), nullable=False),
        Column("task_sha256", String(64), nullable=False),
        Column("design", Integer, nullable=False),
    )
    return columns


def _of_participant() -> ForeignKeyConstraint:
    return ForeignKeyConstraint(["study", "participant"], ["cathxr_participant.study", "cathxr_participant.code"])


TRIAL_START = Table("cathxr_trial_start", METADATA, *_trial_columns(), _of_participant())

TRIAL = Table(
    "cathxr_trial", METADATA, *_trial_columns(),
    Column("outcome", String(16), nullable=False),
    Column("active_s", Double, nullable=False),
    Column("unseen_share", Double, nullable=False),
    Column("invalid", Text, nullable=False),
    Column("measures", Text, nullable=False),
    Column("targets", Text, nullable=False),
    _of_participant(),
    Index("cathxr_trial_of", "study", "participant", "condition"),
)  # fmt: skip

ANSWER = Table(
    "cathxr_answer", METADATA,
    Column("study", String(64), primary_key=True),
    Column("participant", String(16), primary_key=True),
    Column("survey", String(64), primary_key=True),
    Column("occasion", String(64), primary_key=True),
    Column("item", String(64), primary_key=True),
    Column("value", Double),
    Column("words", Text, nullable=False),
    Column("answered", String(40), nullable=False),
    _of_participant(),
)  # fmt: skip

LOG = Table(
    "cathxr_log", METADATA,
    Column("id", Integer, Identity(), primary_key=True),
    Column("study", String(64), nullable=False),
    Column("at", String(40), nullable=False),
    Column("what", String(64), nullable=False),
    Column("participant", String(16), nullable=False),
    Column("detail", Text, nullable=False),
    ForeignKeyConstraint(["study"], ["cathxr_study.key"]),
)  # fmt: skip
