"""Which files a script's result comes from."""

import os
import shutil

import pytest

from isarflow.core.errors import InputError
from isarflow.setup import closure

FILES = {
    "isarflow/stage/__init__.py": "",
    "isarflow/stage/job.py": "import isarflow.other.deep as d\nfrom isarflow.stage import near\nfrom . import beside\n",
    "isarflow/stage/near.py": "def later():\n    from .beside import what\n",
    "isarflow/stage/beside.py": "from ..core import ground\nimport isarflow.stage.job",
    "isarflow/stage/unused.py": "",
    "isarflow/other/__init__.py": "",
    "isarflow/other/deep.py": "",
    "isarflow/core/ground.py": "",
}


@pytest.fixture
def scripts(tmp_path, monkeypatch):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(closure, "HERE", tmp_path)
    forget()
    yield tmp_path
    forget()


def forget():
    """Clear what this process keeps, as another start of Snakemake has it."""
    for cached in (closure.closure, closure._read, closure.digest):
        cached.cache_clear()


def test_everything_imported_counts_however_it_is_written(scripts):
    assert closure.closure("isarflow/stage/job.py") == sorted(FILES.keys() - {"isarflow/stage/unused.py"})
    assert closure.closure("isarflow/core/ground.py") == ["isarflow/core/ground.py"]


def test_a_module_that_is_not_python_is_named(scripts):
    (scripts / "isarflow/stage/near.py").write_text("import numpy\ndef (:\n")
    with pytest.raises(InputError, match=r"isarflow/stage/near\.py, line 2: not Python"):
        closure.closure("isarflow/stage/job.py")


CODE = """\"\"\"What it is for.\"\"\"

import isarflow.other.deep


class Thing:
    \"\"\"Has a part.\"\"\"

    part: int = 1

    async def wait(self, count=2):
        \"\"\"Waits.\"\"\"
        return f"{count:.1f} s"  # why


def first(x):
    return "a" "b" + x
"""


def digest_of(scripts, text):
    (scripts / "isarflow/stage/near.py").write_text(text)
    forget()
    return closure.digest("isarflow/stage/near.py")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("What it is for", "What it was for"),
        ('"""Has a part."""\n\n    ', ""),
        ("  # why", ""),
        ("        return f", "        return \\\n            f"),
        ("\n\n\ndef first", "\n\n# More.\n\n\ndef first"),
    ],
)
def test_comments_docstrings_and_layout_do_not_count(scripts, old, new):
    assert CODE.count(old) == 1
    assert digest_of(scripts, CODE.replace(old, new)) == digest_of(scripts, CODE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("= 1", "= 1.0"),
        ("count=2", "count=3"),
        (":.1f}", ":.2f}"),
        ('"a" "b"', '"a" "c"'),
        ("async def", "def"),
        ("import isarflow.other.deep", "import isarflow.other.deep as deep"),
        ("return f", "yield f"),
    ],
)
def test_all_else_counts(scripts, old, new):
    assert CODE.count(old) == 1
    assert digest_of(scripts, CODE.replace(old, new)) != digest_of(scripts, CODE)


def test_what_is_imported_counts_and_so_does_where_it_is(scripts):
    before = digest_of(scripts, CODE)
    (scripts / "isarflow/other/deep.py").write_text("x = 1")
    changed = digest_of(scripts, CODE)
    assert changed != before
    (scripts / "isarflow/other/__init__.py").write_text("x = 1")
    (scripts / "isarflow/other/deep.py").write_text("")
    assert digest_of(scripts, CODE) not in (before, changed)


def test_every_version_of_python_has_the_same_digest(scripts):
    """3.11, 3.12 and 3.13 were asked."""
    assert digest_of(scripts, CODE) == "84eaae6534b934ef5709b2c022b78728741269c1a19fb9cc518968af1444873d"


def test_a_file_counts_by_its_name_from_the_repository_however_its_path_is_written(scripts):
    (scripts / "mine").mkdir()
    (scripts / "mine/near.py").write_text("import beside\n" + CODE)
    (scripts / "mine/beside.py").write_text("x = 1\n")
    found = closure.digest("mine/near.py")
    assert closure.digest(str(scripts / "mine/near.py")) == found
    (scripts / "mine/beside.py").write_text("x = 2\n")
    forget()
    assert closure.digest("mine/near.py") != found


def test_a_file_is_read_again_where_its_content_changed_and_only_there(scripts, monkeypatch):
    first, near = digest_of(scripts, CODE), scripts / "isarflow/stage/near.py"
    (kept,) = (scripts / "isarflow/stage/__pycache__").glob("near.*")
    with monkeypatch.context() as patch:
        patch.setattr(closure.ast, "parse", None)
        assert digest_of(scripts, CODE) == first
    was = near.stat()
    near.write_text(CODE.replace("count=2", "count=3"))
    os.utime(near, ns=(was.st_atime_ns, was.st_mtime_ns))
    forget()
    assert closure.digest("isarflow/stage/near.py") != first
    # What another version kept of the same file, and what was cut short.
    monkeypatch.setattr(closure, "OWN_CODE", b"")
    with monkeypatch.context() as patch:
        patch.setattr(closure.ast, "parse", None)
        with pytest.raises(TypeError):
            digest_of(scripts, CODE)
    assert digest_of(scripts, CODE) == first
    kept.write_bytes(kept.read_bytes()[:-9])
    assert digest_of(scripts, CODE) == first


def test_where_nobody_may_write_nothing_is_kept(scripts):
    first = digest_of(scripts, CODE)
    shutil.rmtree(scripts / "isarflow/stage/__pycache__")
    (scripts / "isarflow/stage/__pycache__").touch()
    assert digest_of(scripts, CODE) == first
