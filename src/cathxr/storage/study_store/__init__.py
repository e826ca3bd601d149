"""Study stores: SQLite by default, PostgreSQL by address. Needs the extra `study` (SQLAlchemy, psycopg)."""

from cathxr.storage.study_store.nouns import Deleted, LogEntry, StoredDesign
from cathxr.storage.study_store.store import StudyStore

__all__ = ["Deleted", "LogEntry", "StoredDesign", "StudyStore"]
