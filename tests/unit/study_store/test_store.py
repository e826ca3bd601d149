"""The store, on SQLite and on a real PostgreSQL alike: what goes in comes out, and what must not go in does not."""

from dataclasses import replace

import pytest

from cathxr.core import ConfigError, DataError
from cathxr.core.trials import Outcome, Participant, TrialStart
from cathxr.storage.study_store import StudyStore

from .records import AT, answer, trial


def test_trials_come_back_bit_for_bit(store: StudyStore) -> None:
    store.enrol(Participant("P01", joined=AT), at=AT)
    written = trial("a")
    store.record(written, at=AT)
    (read,) = store.trials()
    assert read == written
    assert repr(dict(read.measures)) == repr(dict(sorted(written.measures.items())))
    assert store.trials(participant="P02") == ()


def test_the_same_trial_again_changes_nothing_and_another_of_its_id_is_refused(store: StudyStore) -> None:
    store.enrol(Participant("P01"), at=AT)
    store.record(trial("a"), at=AT)
    store.mark("a", "bumped", at=AT)
    store.record(trial("a"), at=AT)
    assert [each.invalid for each in store.trials()] == ["bumped"]
    with pytest.raises(DataError, match="another trial a is there"):
        store.record(trial("a", active_s=1.0), at=AT)
    assert store.trials()[0].active_s == trial("a").active_s


def test_many_trials_are_kept_all_or_none(store: StudyStore) -> None:
    store.enrol(Participant("P01"), at=AT)
    with pytest.raises(DataError, match="no participant P02"):
        store.record_all([trial("a"), trial("b", "P02")], at=AT)
    assert store.trials() == ()
    assert [each.what for each in store.log()][-1] == "participant enrolled"


def test_a_trial_that_was_cut_off_is_known(store: StudyStore) -> None:
    store.enrol(Participant("P01"), at=AT)
    starts = [TrialStart(each, "P01", "six_targets", "2d", 1, 1, f"2026-01-0{place}", session=each)
              for place, each in enumerate("abc", 1)]  # fmt: skip
    for each in starts:
        store.begin(each, at=AT)
    assert store.unfinished() == tuple(starts)
    store.record(trial("a"), at=AT)
    kept = store.interrupt("b", active_s=4.0, at=AT)
    assert kept.outcome is Outcome.INTERRUPTED
    assert kept.session == "b"
    assert [each.id for each in store.unfinished()] == ["c"]
    assert {each.id for each in store.trials()} == {"a", "b"}
    for taken in ("a", "c"):
        with pytest.raises(DataError, match="is there already"):
            store.begin(replace(starts[0], id=taken), at=AT)
    with pytest.raises(DataError, match="no unfinished trial b"):
        store.interrupt("b", active_s=0.0, at=AT)
    with pytest.raises(DataError, match="began with another participant or condition"):
        store.record(trial("c", condition="3d"), at=AT)


def test_draws_are_numbered_in_their_group_and_stay(store: StudyStore) -> None:
    made = [store.draw(code, lambda number: f"s{number}", group=group, at=AT)
            for code, group in (("P01", ""), ("N-01", "novice"), ("P02", ""), ("P01", ""))]  # fmt: skip
    assert [(each.number, each.sequence) for each in made] == [(1, "s1"), (1, "s1"), (2, "s2"), (1, "s1")]
    assert len(store.draws()) == 3
    assert [each.sequence for each in store.participants()] == ["s1", "s1", "s2"]
    with pytest.raises(DataError, match="drawn in group"):
        store.draw("P01", lambda number: "x", group="novice", at=AT)


def test_a_draw_for_one_who_was_enrolled_before(store: StudyStore) -> None:
    store.enrol(Participant("P01"), at=AT)
    store.draw("P01", lambda number: "2d>3d", at=AT)
    assert store.participants() == (Participant("P01", "2d>3d"),)
    store.enrol(Participant("P02", "3d>2d"), at=AT)
    with pytest.raises(DataError, match="not drawn again"):
        store.draw("P02", lambda number: "2d>3d", at=AT)


def test_answers_are_replaced_only_when_asked_for(store: StudyStore) -> None:
    store.enrol(Participant("P01"), at=AT)
    words = answer(item="remark", value=None, text='böse "x"\n=1+1')
    assert store.answer([answer(), words], at=AT) == 2
    assert set(store.answers()) == {answer(), words}
    assert store.answer([answer()], at=AT) == 0
    with pytest.raises(DataError, match="another answer to paper q1 end"):
        store.answer([answer(item="q2"), answer(value=5.0)], at=AT)
    assert len(store.answers()) == 2
    assert store.answer([answer(value=5.0), words], at=AT, replace=True) == 1
    assert set(store.answers()) == {answer(value=5.0), words}
    assert "was 3" in store.log()[-2].detail


def test_many_answers_of_many_people_at_once_are_all_or_none(store: StudyStore) -> None:
    codes = [f"P{each}" for each in range(1100)]  # more than a database takes in one list
    given = [answer(code, item) for code in codes for item in ("q1", "q2")]
    with pytest.raises(DataError, match="no participant P999 in study"):
        store.answer(given, at=AT, enrol=[Participant(each) for each in codes if each != "P999"])
    assert store.participants() == store.answers() == ()
    enrolled = [Participant(each, joined=AT) for each in codes]
    assert store.answer(given, at=AT, enrol=enrolled) == 2200
    assert set(store.answers()) == set(given)
    with pytest.raises(DataError, match="P7 is enrolled already"):
        store.answer([], at=AT, enrol=[Participant("P7")])
    with pytest.raises(DataError, match="P4000 is enrolled already"):
        store.answer([], at=AT, enrol=[Participant("P4000"), Participant("P4000")])
    # the same place twice in one call: as if in two
    assert store.answer([answer("P5", "q3"), answer("P5", "q3")], at=AT) == 1
    assert store.answer([answer("P6", "q3"), answer("P6", "q3", 4.0)], at=AT, replace=True) == 2
    assert answer("P6", "q3", 4.0) in store.answers()
    changed = [answer(code, "q1", 1.0) for code in codes]
    with pytest.raises(DataError, match="another answer"):
        store.answer([*changed[:-1], answer("P0", "q9"), changed[-1]], at=AT)
    assert store.answer(changed, at=AT, replace=True) == 1100
    assert sum(each.value == 1.0 for each in store.answers()) == 1100


def test_a_design_is_fixed_once_there_is_data(store: StudyStore) -> None:
    assert store.adopt("one", at=AT).version == 1
    assert store.adopt("one", at=AT).version == 1
    assert store.adopt("two", at=AT).version == 2
    store.draw("P01", lambda number: "2d>3d", at=AT)
    assert store.adopt("two", at=AT).version == 2
    with pytest.raises(ConfigError, match="the design is fixed"):
        store.adopt("three", at=AT)
    assert store.adopt("three", at=AT, reason="a pilot").version == 3
    assert [each.text for each in store.designs()] == ["one", "two", "three"]
    assert store.designs()[-1].reason == "a pilot"


def test_a_deleted_participant_leaves_nothing_but_a_place_in_the_draws(store: StudyStore) -> None:
    for code in ("P01", "P02"):
        store.draw(code, lambda number: "2d>3d", at=AT)
        store.record(trial(f"t-{code}", code, session="shared"), at=AT)
        store.record(trial(f"u-{code}", code, number=2), at=AT)
        store.answer([answer(code)], at=AT)
    store.begin(TrialStart("v", "P01", "six_targets", "2d", 3, 1, AT, session="recordings/v"), at=AT)
    expected = store.deletion_of("P01")
    gone = store.delete("P01", at=AT)
    assert gone == expected
    assert (gone.trials, gone.answers, gone.shared) == (3, 1, ("shared",))
    assert gone.sessions == ("recordings/u-P01", "recordings/v")
    everything = repr(
        [store.participants(), store.trials(), store.unfinished(), store.answers(), store.draws(), store.log()]
    )
    assert "P01" not in everything
    assert [each.participant for each in store.draws()] == ["", "P02"]
    assert store.draw("P03", lambda number: f"n{number}", at=AT).sequence == "n3"
    with pytest.raises(DataError, match="no participant P01"):
        store.delete("P01", at=AT)


def test_two_studies_of_one_store_do_not_see_each_other(store: StudyStore, key: str) -> None:
    store.enrol(Participant("P01"), at=AT)
    store.record(trial("a"), at=AT)
    place = store._engine.url.render_as_string(hide_password=False)
    with StudyStore.create(place, study=f"{key}-b", seed=5, software="2", at=AT) as other:
        assert other.participants() == other.trials() == other.draws() == ()
        assert (store.seed(), other.seed()) == (11, 5)
    with pytest.raises(ConfigError, match="no study none-such in this store"):
        StudyStore.open(place, study="none-such")
    with StudyStore.create(place, study=key, seed=99, software="2", at=AT) as again:
        assert again.seed() == 11
        assert again.trials() == (trial("a"),)
