"""Slices over HTTP: exact, for those with the key alone, and kept nowhere."""

import asyncio
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from cathxr.app.heart_seeds_file import SeedsWriter
from cathxr.core import DataError
from cathxr.heart.seeds import read_seeds
from cathxr.heart.volume import Volume
from cathxr.runtime.heart_seeds import SeedSession
from cathxr.wire.heart_pages import KEY_HEADER, make_slices_router

from .conftest import labels_of, seed

Get = Callable[..., httpx.Response]


@pytest.fixture
def get(make_session: Callable[..., SeedSession]) -> Get:
    """A function that asks for a path below /heart/, with the key unless other headers are given."""
    app = FastAPI()
    app.include_router(make_slices_router(make_session(labels=labels_of()).slices, key="right"))

    def ask(path: str, headers: dict[str, str] | None = None) -> httpx.Response:
        async def answer() -> httpx.Response:
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://test") as client:
                return await client.get(f"/heart/{path}", headers={KEY_HEADER: "right"} if headers is None else headers)

        return asyncio.run(answer())

    return ask


def test_a_slice_is_the_volumes_own(get: Get, volume: Volume) -> None:
    answer = get("ct/coronal/4.bin")
    # Slices are seen from the head down, the volume is stored from the feet up.
    assert (np.frombuffer(answer.content, "<i2").reshape(8, 12) == volume.hu[::-1, 4]).all()
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["content-type"] == "application/octet-stream"
    sagittal = np.frombuffer(get("ct/sagittal/11.bin").content, "<i2").reshape(8, 10)
    assert (sagittal == volume.hu[::-1, :, 11]).all()


@pytest.mark.parametrize(
    "path", ["ct/axial/8.bin", "ct/axial/-1.bin", "ct/oblique/0.bin", "labels/2/axial/0.bin", "labels/0/axial/0.bin"]
)
def test_what_is_not_there_is_not_found(get: Get, path: str) -> None:
    assert get(path).status_code == 404


@pytest.mark.parametrize("headers", [{}, {KEY_HEADER: "wrong"}, {KEY_HEADER: ""}])
def test_nobody_sees_a_slice_without_the_key(get: Get, headers: dict[str, str]) -> None:
    for path in ("ct/axial/0.bin", "labels/1/axial/0.bin", "ct/axial/99.bin"):
        answer = get(path, headers)
        assert answer.status_code == 403
        assert "pair first" in answer.json()["error"]


def test_the_key_is_given_by_a_command_alone(make_session: Callable[..., SeedSession]) -> None:
    session = make_session(labels=labels_of(), key="secret-key")
    assert session.handle("seeds_open", {}) == {"key": "secret-key"}
    assert "secret-key" not in session.state().model_dump_json()


def test_the_file_is_written_whole_and_the_earlier_one_kept_once(tmp_path: Path) -> None:
    out = tmp_path / "seeds.csv"
    out.write_text("structure,x_mm,y_mm,z_mm\naorta,1,2,3\n")
    writer = SeedsWriter(out)
    for x in (4.0, 5.0):
        writer.save([seed("left_atrium", (x, 5.0, 6.0))])
    assert [tuple(each.position_mm) for each in read_seeds(out)] == [(5.0, 5.0, 6.0)]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["seeds.csv", "seeds.csv.bak"]
    assert "aorta" in (tmp_path / "seeds.csv.bak").read_text()


def test_a_failure_to_write_names_no_path(tmp_path: Path) -> None:
    gone = tmp_path / "mrs_somebody" / "seeds.csv"
    with pytest.raises(DataError, match="could not be written") as caught:
        SeedsWriter(gone).save([seed("aorta", (1.0, 2.0, 3.0))])
    assert "somebody" not in str(caught.value)
