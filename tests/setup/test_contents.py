"""Files that a user names: what they hold decides, whatever their dates, and each is read once."""

import hashlib
import os
import time

import pytest

from isarflow.core.errors import InputError
from isarflow.scattering.fields import field_files
from isarflow.setup import contents

OLD = (1e9, 1e9)  # s, times of access and change that a copy may bring along


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """asked(path): its digest, as another process finds it; `asked.read` lists what was read for it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(contents, "SETTLED", -1_000_000_000)  # the tests' files are younger than others

    def ask(path):
        contents.sha256.cache_clear()
        return contents.sha256(path)

    def digest(path, plain=field_files.digest):
        ask.read.append(path)
        return plain(path)

    ask.read = []
    monkeypatch.setattr(field_files, "digest", digest)
    return ask


def written(path, content, times=OLD):
    time.sleep(0.02)  # s: the file system's clock has ticked since whatever was written before
    path.write_bytes(content)
    os.utime(path, times)
    return str(path)


def test_a_file_is_read_once_and_again_when_something_about_it_changes(asked, tmp_path):
    path = written(tmp_path / "{a} 1.ffe", b"first")
    first = hashlib.sha256(b"first").hexdigest()
    assert [asked(path), asked(path), asked(os.path.relpath(path))] == [first] * 3
    assert asked.read == [path]
    os.utime(path)
    assert asked(path) == first and len(asked.read) == 2


@pytest.mark.parametrize("how", ["written over", "another file", "older"])
def test_another_content_of_the_same_size_is_seen_whatever_the_date(asked, tmp_path, how):
    path = tmp_path / "a.obj"
    asked(written(path, b"first"))
    if how == "another file":
        written(tmp_path / "b.obj", b"other")
        os.replace(tmp_path / "b.obj", path)
    else:
        written(path, b"other", OLD if how == "written over" else (1, 1))
    assert asked(str(path)) == hashlib.sha256(b"other").hexdigest()


@pytest.mark.parametrize("change", ["a chunk", "its date", "a chunk less", "a name", "a desktop", "nothing"])
def test_a_store_is_the_names_and_contents_of_its_files(asked, tmp_path, change):
    for name in ("0.0", "0.1"):
        (tmp_path / "a.zarr/field").mkdir(parents=True, exist_ok=True)
        written(tmp_path / "a.zarr/field" / name, b"chunk")
    chunk = tmp_path / "a.zarr/field/0.1"
    first = asked("a.zarr")
    if change == "a chunk":
        written(chunk, b"other")
    if change == "its date":
        os.utime(chunk)
    if change == "a chunk less":
        chunk.unlink()
    if change == "a desktop":
        written(tmp_path / "a.zarr/.DS_Store", b"icons")
    if change == "a name":
        chunk.rename(chunk.with_name("1.0"))
    assert (asked("a.zarr") == first) == (change in ("its date", "a desktop", "nothing"))
    assert len(asked.read) == (1 if change in ("a desktop", "nothing") else 2)


def test_a_folder_of_a_store_may_be_a_link(asked, tmp_path):
    (tmp_path / "a.zarr").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "a.zarr/field").symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    first = asked("a.zarr")
    written(tmp_path / "elsewhere/0.0", b"chunk")
    assert asked("a.zarr") != first


@pytest.mark.parametrize("note", [b"", b"{}", b"\xff\0" * 65, "half", "of another state", "a folder"])
def test_a_damaged_note_is_not_believed(asked, tmp_path, note):
    path = written(tmp_path / "a.ffe", b"first")
    first = asked(path)
    (kept,) = contents.KEPT.iterdir()
    text = kept.read_text()
    if note == "a folder":
        kept.unlink()
        kept.mkdir()
    else:
        damaged = {"half": text[:-8].encode(), "of another state": f"{'0' * 64} {'1' * 64}\n".encode()}
        kept.write_bytes(damaged.get(note, note))
    assert asked(path) == first and len(asked.read) == 2
    assert note == "a folder" or kept.read_text() == text


def test_where_nothing_can_be_kept_files_are_read_again(asked, tmp_path):
    (tmp_path / ".snakemake").write_text("not a folder")
    path = written(tmp_path / "a.ffe", b"first")
    assert asked(path) == asked(path) and len(asked.read) == 2


def test_a_file_that_has_just_changed_is_read_again(asked, tmp_path, monkeypatch):
    """Its next change may come within one step of the file system's clock."""
    monkeypatch.setattr(contents, "SETTLED", 3_000_000_000)
    path = written(tmp_path / "a.ffe", b"first")
    assert asked(path) == asked(path) and len(asked.read) == 2
    now = time.time_ns()
    monkeypatch.setattr(time, "time_ns", lambda: now + 4_000_000_000)
    assert asked(path) == asked(path) and len(asked.read) == 3


def test_a_run_keeps_to_what_it_found_first(asked, tmp_path):
    """Snakemake notes it when the job has ended: what changed meanwhile reruns the job."""
    path = written(tmp_path / "a.ffe", b"first")
    first = asked(path)
    written(tmp_path / "a.ffe", b"other")
    assert contents.sha256(path) == first != asked(path)


def test_a_file_that_is_gone_is_named(asked, tmp_path):
    with pytest.raises(InputError, match=r"gone\.ffe cannot be read: No such file"):
        asked(str(tmp_path / "gone.ffe"))
