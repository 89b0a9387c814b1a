"""Every rule says what it takes and where it writes of itself."""

import re

import pytest

from isarflow.setup.config import ROOT

TEXTS = [path.read_text() for path in sorted((ROOT / "workflow/rules").glob("*.smk"))]
RULES = {
    name: body for text in TEXTS for name, body in re.findall(r"^rule (\w+):\n((?:(?:    .*)?\n)+)", text, re.MULTILINE)
}
# One that is made for each of several sets, in a loop.
RULES |= {
    re.search(r'name:\s+f?"(\w+)', body)[1]: re.sub("^    ", "", body, flags=re.MULTILINE)
    for text in TEXTS
    for body in re.findall(r"^    rule:\n((?:(?:        .*)?\n)+)", text, re.MULTILINE)
}


def test_all_rules_are_found():
    assert len(RULES) == sum(len(re.findall(r"^ *rule\b.*:$", text, re.MULTILINE)) for text in TEXTS) > 10
    assert "predict" in RULES


@pytest.mark.parametrize("rule", RULES)
def test_rule_has_a_log_and_all_else(rule):
    for directive in ("output", "log", "benchmark", "conda", "threads", "resources", "message", "script"):
        assert re.search(rf"^    {directive}:", RULES[rule], re.MULTILINE), f"rule {rule} has no {directive}"
    assert re.search(r"^        mem_mb=", RULES[rule], re.MULTILINE), f"rule {rule} has no mem_mb"
    (script,) = re.findall(r'^        "\.\./scripts/(\S+)"$', RULES[rule], re.MULTILINE)
    assert re.search(rf'code=(lambda w: )?code\("{script}"', RULES[rule]), f"rule {rule} does not count its script"
