"""Programs that are killed, programs that write at once, and full disks: nothing kept is lost, nothing is half."""

import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from cathxr.core.trials import Participant
from cathxr.storage.study_store import StudyStore
from cathxr.study.allocation import draw_faults, drawn_sequence
from cathxr.study.design import sequence_text
from cathxr.study.design_file import design_from_text
from cathxr.study.design_template import design_template

from ...training_support.disks import small_disk
from ...training_support.postgres import PostgresServer
from .records import AT, trial

WRITER = Path(__file__).with_name("writer.py")


def writer(place: str, study: str, code: str, how: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, str(WRITER), place, study, code, how], stdout=subprocess.PIPE, text=True, encoding="utf-8"
    )


def line(program: "subprocess.Popen[str]") -> str:
    assert program.stdout is not None
    return program.stdout.readline().strip()


def killed(program: "subprocess.Popen[str]") -> list[str]:
    """Kill a program as nothing can be caught, and return what it had still said."""
    program.kill()
    # by the same stream as before: `communicate` would pass over the lines that it has read ahead
    assert program.stdout is not None
    rest = program.stdout.read()
    program.stdout.close()
    program.wait(timeout=60)
    return rest.split("\n")[:-1]


def assert_sound(place: str) -> None:
    if "://" not in place:
        with closing(sqlite3.connect(place)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]


def test_killed_between_and_in_writes(store: StudyStore, place: str, key: str) -> None:
    for code in ("P01", "P02", "P03"):
        store.enrol(Participant(code), at=AT)
        before = len(store.trials())
        program = writer(place, key, code, "forever")
        said = [line(program) for _ in range(random.randint(3, 12))]
        said += killed(program)
        assert_sound(place)
        kept = store.trials()
        # what was said to be kept is there; one more may be, that was kept and not yet said
        assert set(said) <= {each.id for each in kept}
        assert before + len(said) <= len(kept) <= before + len(said) + 1
        assert all(each == trial(each.id, each.participant, number=each.number) for each in kept)
        store.record(trial(f"after-{code}", code), at=AT)


def test_killed_in_the_middle_of_a_transaction(store: StudyStore, place: str, key: str) -> None:
    store.enrol(Participant("P01"), at=AT)
    store.record(trial("before"), at=AT)
    program = writer(place, key, "P01", "halfway")
    assert line(program) == "halfway"
    if "://" not in place:
        assert Path(f"{place}-journal").stat().st_size > 0
    killed(program)
    # whoever comes next finds what was there before, and may write
    with StudyStore.open(place, study=key) as again:
        assert [each.id for each in again.trials()] == ["before"]
        again.record(trial("after"), at=AT)
    assert_sound(place)
    assert {each.id for each in store.trials()} == {"before", "after"}


def test_two_writers_at_once(store: StudyStore, place: str, key: str) -> None:
    programs = []
    for code in ("P01", "P02"):
        store.enrol(Participant(code), at=AT)
        programs.append(writer(place, key, code, "40"))
    for number in range(10):
        store.enrol(Participant(f"Q{number}"), at=AT)
    for program in programs:
        said, _ = program.communicate(timeout=300)
        assert program.returncode == 0
        assert len(said.split()) == 40, said
    assert {each.id for each in store.trials()} == {f"P0{code}-{each}" for code in (1, 2) for each in range(40)}
    assert len(store.participants()) == 12
    assert_sound(place)


DRAWING = """
import sys
from cathxr.storage.study_store import StudyStore
place, study, letter = sys.argv[1:]
with StudyStore.open(place, study=study) as store:
    from cathxr.study.allocation import drawn_sequence
    from cathxr.study.design import sequence_text
    from cathxr.study.design_file import design_from_text
    design = design_from_text(store.designs()[-1].text)
    for each in range(20):
        store.draw(f"{letter}{each}", lambda n: sequence_text(drawn_sequence(design, 11, "", n)), at="2026-01-01")
"""


def test_two_sites_that_allocate_at_once_draw_from_one_list(store: StudyStore, place: str, key: str) -> None:
    text = design_template(key=key, title="t", task="six_targets", practice="practice", planned=40)
    store.adopt(text, at=AT)
    programs = [subprocess.Popen([sys.executable, "-c", DRAWING, place, key, letter]) for letter in "AB"]
    assert [program.wait(timeout=300) for program in programs] == [0, 0]
    draws = store.draws()
    assert [each.number for each in draws] == list(range(1, 41))
    design = design_from_text(text)
    assert draw_faults(design, 11, draws) == ()
    assert [each.sequence for each in draws] == [sequence_text(drawn_sequence(design, 11, "", n)) for n in range(1, 41)]


def test_a_disk_that_refuses(tmp_path: Path) -> None:
    place = str(tmp_path / "study.sqlite")
    with StudyStore.create(place, study="s", seed=1, software="1", at=AT) as store:
        store.enrol(Participant("P01"), at=AT)
        said, _ = writer(place, "s", "P01", "limited").communicate(timeout=300)
        check_refused(store, said)
    assert_sound(place)


def test_a_full_disk(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", megabytes=1) as disk:
        place = str(disk / "study.sqlite")
        with StudyStore.create(place, study="s", seed=1, software="1", at=AT) as store:
            store.enrol(Participant("P01"), at=AT)
            ballast = disk / "ballast"
            ballast.write_bytes(b"x" * 830_000)
            said, _ = writer(place, "s", "P01", "full").communicate(timeout=300)
            ballast.unlink()
            check_refused(store, said)
        assert_sound(place)


@pytest.fixture
def open_path() -> Iterator[Path]:
    """A folder that other users may go into, which pytest's own are not."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


def test_a_full_disk_of_the_databases_server(open_path: Path, postgres_server: PostgresServer, key: str) -> None:
    # The database's tables lie on a disk of their own; the server's log of changes has room, as it has to.
    psycopg = pytest.importorskip("psycopg")
    with small_disk(open_path / "disk", megabytes=16) as disk:
        tables = disk / "tables"
        tables.mkdir()
        if postgres_server.user is not None:
            shutil.chown(tables, postgres_server.user)
        with psycopg.connect(postgres_server.address, autocommit=True) as boss:
            boss.execute(f"CREATE TABLESPACE small LOCATION '{tables}'")
            try:
                boss.execute("CREATE DATABASE small TABLESPACE small")
                place = postgres_server.address.rsplit("/", 1)[0] + "/small"
                _fill_and_check(place, disk / "ballast", key, settle=lambda: boss.execute("CHECKPOINT"))
            finally:
                boss.execute("DROP DATABASE IF EXISTS small WITH (FORCE)")
                boss.execute("DROP TABLESPACE small")


def _fill_and_check(place: str, ballast: Path, key: str, *, settle: Callable[[], object]) -> None:
    with StudyStore.create(place, study=key, seed=1, software="1", at=AT) as store:
        store.enrol(Participant("P01"), at=AT)
        settle()  # what the server has in memory only takes its room now
        room = shutil.disk_usage(ballast.parent).free
        ballast.write_bytes(b"x" * (room - 1_200_000))
        said, _ = writer(place, key, "P01", "full").communicate(timeout=300)
        ballast.unlink()
        check_refused(store, said)


def check_refused(store: StudyStore, said: str) -> None:
    """What was said to be kept is there and nothing else, the refusal is plain, and there is life after it."""
    *ids, refusal = said.strip().split("\n")
    assert len(ids) > 5
    assert refusal.startswith("refused: ")
    assert "disk" in refusal
    assert "Nothing of this was written, and what was stored before is intact." in refusal
    assert sorted(each.id for each in store.trials()) == sorted(ids)
    store.record(trial(f"P01-{len(ids)}", number=len(ids) + 1), at=AT)
    assert len(store.trials()) == len(ids) + 1


def test_a_connection_that_is_cut(postgres: str, key: str) -> None:
    psycopg = pytest.importorskip("psycopg")
    with StudyStore.create(postgres, study=key, seed=1, software="1", at=AT) as store:
        store.enrol(Participant("P01"), at=AT)
        program = writer(postgres, key, "P01", "halfway")
        assert line(program) == "halfway"
        with psycopg.connect(postgres, autocommit=True) as boss:
            boss.execute("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = 'cathxr'")
        # the pool notices by itself; what the other had begun is gone
        store.record(trial("after"), at=AT)
        assert [each.id for each in store.trials()] == ["after"]
        killed(program)
