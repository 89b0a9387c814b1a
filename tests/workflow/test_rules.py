"""Every rule says what it takes and where it writes of itself."""

import re

import pytest

from setup.config import ROOT

RULES = {
    name: body
    for path in sorted((ROOT / "workflow/rules").glob("*.smk"))
    for name, body in re.findall(r"^rule (\w+):\n((?:(?:    .*)?\n)+)", path.read_text(), re.MULTILINE)
}


def test_all_rules_are_found():
    count = sum(path.read_text().count("\nrule ") for path in (ROOT / "workflow/rules").glob("*.smk"))
    assert len(RULES) == count > 10


@pytest.mark.parametrize("rule", RULES)
def test_rule_has_a_log_and_all_else(rule):
    for directive in ("output", "log", "benchmark", "conda", "threads", "resources", "message", "script"):
        assert re.search(rf"^    {directive}:", RULES[rule], re.MULTILINE), f"rule {rule} has no {directive}"
    assert re.search(r"^        mem_mb=", RULES[rule], re.MULTILINE), f"rule {rule} has no mem_mb"
    (script,) = re.findall(r'^        "\.\./scripts/(\S+)"$', RULES[rule], re.MULTILINE)
    assert f'code=code("{script}")' in RULES[rule], f"rule {rule} does not count its script among its inputs"
