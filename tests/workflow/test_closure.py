"""Which files a script's result comes from."""

import pytest

from core.errors import InputError
from setup import closure

FILES = {
    "stage/__init__.py": "",
    "stage/job.py": "import numpy\nimport other.deep as d\nfrom stage import near\nfrom . import beside\n",
    "stage/near.py": "def later():\n    from .beside import what\n",
    "stage/beside.py": "from ..core import ground\nimport stage.job",
    "stage/unused.py": "",
    "other/__init__.py": "",
    "other/deep.py": "",
    "core/ground.py": "",
}


@pytest.fixture
def scripts(tmp_path, monkeypatch):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(closure, "SCRIPTS", tmp_path)
    for cached in (closure.closure, closure._imported):
        cached.cache_clear()
    yield tmp_path
    for cached in (closure.closure, closure._imported):
        cached.cache_clear()


def test_everything_imported_counts_however_it_is_written(scripts):
    assert closure.closure("stage/job.py") == sorted(FILES.keys() - {"stage/unused.py"})
    assert closure.closure("core/ground.py") == ["core/ground.py"]


def test_a_module_that_is_not_python_is_named(scripts):
    (scripts / "stage/near.py").write_text("import numpy\ndef (:\n")
    with pytest.raises(InputError, match=r"workflow/scripts/stage/near\.py, line 2: not Python"):
        closure.closure("stage/job.py")
