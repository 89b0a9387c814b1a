"""Odd configs, from seeds: read and checked here as every run does first; `odd_configs.py` plans runs with them."""

import time

import pytest
from odd_configs import LIMIT, odd_config

from isarflow.core.errors import InputError
from isarflow.setup.config import load_config, unnamed
from isarflow.setup.overview import overview
from isarflow.setup.yaml_file import read_yaml

EACH = 25  # configs a test


@pytest.mark.parametrize("first", range(0, 100, EACH))
def test_an_odd_config_is_read_or_refused_in_words(first, tmp_path):
    path, ends = tmp_path / "odd.yaml", {"read": 0, "refused": 0}
    for seed in range(first, first + EACH):
        path.write_text(odd_config(seed))
        start = time.monotonic()
        try:
            mine = read_yaml(path)
            config = load_config(mine)
            overview(config, tmp_path / "results")
            unnamed(config, mine)
            ends["read"] += 1
        except InputError as error:
            assert str(error).strip(), seed
            ends["refused"] += 1
        assert time.monotonic() - start < LIMIT, seed
    # Else they were not odd, or nothing but.
    assert min(ends.values()) > 0
