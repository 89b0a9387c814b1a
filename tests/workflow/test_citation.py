"""CITATION.cff, pyproject.toml and LICENSE say the same."""

import re
import tomllib

from isarflow.setup.config import ROOT
from isarflow.setup.yaml_file import read_yaml


def test_citation_is_whole_and_agrees_with_the_project():
    citation = read_yaml(ROOT / "CITATION.cff")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation["cff-version"] == "1.2.0"
    assert {"message", "title", "authors", "abstract"} <= set(citation)  # the first three the format requires
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"] == "GPL-3.0-or-later"
    assert "GNU GENERAL PUBLIC LICENSE\n                       Version 3" in (ROOT / "LICENSE").read_text()
    (thesis,) = citation["references"]
    assert {"type", "title", "authors"} <= set(thesis)  # what the format requires of a reference


def test_the_changelog_begins_with_the_version():
    versions = re.findall(
        r"^## \[([\d.]+)\] - (unreleased|\d{4}-\d\d-\d\d)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE
    )
    citation = read_yaml(ROOT / "CITATION.cff")
    assert versions[0][0] == citation["version"]
    # A version that has a date has the same one where it is cited.
    assert str(citation.get("date-released", "unreleased")) == versions[0][1]
