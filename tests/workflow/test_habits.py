"""What those who join find: checks that run elsewhere are those that run here, forms that open, a menu of all pages."""

import re
import runpy

import pytest

from isarflow.setup.config import ROOT
from isarflow.setup.yaml_file import read_yaml

FORMS = sorted(path for path in (ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml") if path.name != "config.yml")


def test_ci_runs_what_a_fresh_clone_must_pass():
    steps = [step for job in read_yaml(ROOT / ".github/workflows/ci.yml")["jobs"].values() for step in job["steps"]]
    assert {".ci/run", "make docs"} <= {step.get("run") for step in steps}
    assert (ROOT / ".ci/run").stat().st_mode & 0o111


def test_hooks_check_what_make_lint_checks():
    (repo,) = read_yaml(ROOT / ".pre-commit-config.yaml")["repos"]
    hooks = {re.sub(r"env \S+ |\.venv/bin/", "", hook["entry"]) for hook in repo["hooks"] if ".venv" in hook["entry"]}
    (recipe,) = re.findall(r"^lint: .*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE)
    linted = {line.split(" ")[0] for line in re.sub(r"\tPYTHONPATH=\S+ |\t", "", recipe).splitlines()}
    assert {hook.split(" ")[0] for hook in hooks} == linted - {"snakemake"}  # which takes ten seconds


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_forms_are_what_github_takes(path):
    form = read_yaml(path)
    assert {"name", "description", "body"} <= set(form)
    ids = [part["id"] for part in form["body"]]
    assert len(set(ids)) == len(ids)
    for part in form["body"]:
        assert part["type"] in ("input", "textarea") and part["attributes"]["label"]
        assert set(part) <= {"type", "id", "attributes", "validations"}


def test_the_menu_of_the_site_has_every_page_once():
    space = runpy.run_path(str(ROOT / "docs/conf.py"))
    listed = [page for pages in space["MENU"].values() for page in pages]
    assert len(set(listed)) == len(listed)
    assert {f"docs/{path.stem}" for path in (ROOT / "docs").glob("*.md")} | {"docs/results"} == {
        page for page in listed if page.startswith("docs/")
    }


def test_the_catalog_says_how_to_deploy():
    usage = read_yaml(ROOT / ".snakemake-workflow-catalog.yml")["usage"]
    assert usage["software-stack-deployment"]["conda"] and usage["report"]
    assert set(usage["mandatory-flags"]) == {"desc", "flags"}
    assert (ROOT / "config/README.md").exists()
