# SPDX-License-Identifier: Apache-2.0
"""Files that only other programs read: the workflow, the templates of issues, the citation, the hook before commits."""

import re

import pytest
import yaml
from sources import ROOT

WORKFLOW = ROOT / ".github" / "workflows" / "ci.yml"
TEMPLATES = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
FILES = [WORKFLOW, *TEMPLATES, ROOT / "CITATION.cff", ROOT / ".pre-commit-config.yaml"]


def load(file):
    return yaml.safe_load(file.read_text())


def scripts(job):
    return "\n".join(step.get("run", "") for step in job["steps"])


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_parses(file):
    assert isinstance(load(file), dict)
    assert file.read_text().startswith("# SPDX-License-Identifier: Apache-2.0\n")


@pytest.mark.parametrize("file", [file for file in TEMPLATES if file.name != "config.yml"], ids=lambda file: file.name)
def test_fields_of_a_form_have_names_of_their_own(file):
    form = load(file)
    ids = [field["id"] for field in form["body"] if field["type"] != "markdown"]
    assert form["name"] and form["description"] and ids and len(set(ids)) == len(ids)


def test_workflow_runs_targets_that_exist():
    targets = set(re.findall(r"^([a-z0-9-]+):.*## ", (ROOT / "Makefile").read_text(), re.MULTILINE))
    jobs = load(WORKFLOW)["jobs"]
    used = {name: re.findall(r"^\s*make ([\w-]+)", scripts(job), re.MULTILINE) for name, job in jobs.items()}
    assert {"demo", "test", "lint"} <= set().union(*used.values()) <= targets, used
    assert all("timeout-minutes" in job for job in jobs.values())


@pytest.mark.parametrize("name", ["commands", "lint"])
def test_workflow_installs_what_the_page_names(name):
    page = (ROOT / "docs" / "install.md").read_text()
    needed = page.partition("\nYou need ")[2].partition("\n\n")[0]
    named = " ".join(re.findall(r"`(.+?)`", needed, re.DOTALL)).split()
    packages = re.findall(r"apt-get install -y (.+)", scripts(load(WORKFLOW)["jobs"][name]))
    assert packages and set(" ".join(packages).split()) <= set(named)


def test_hook_before_commits_is_make_lint():
    """The checks are listed in the Makefile only."""
    (repository,) = load(ROOT / ".pre-commit-config.yaml")["repos"]
    (hook,) = repository["hooks"]
    assert repository["repo"] == "local" and hook["entry"] == "make lint" and hook["language"] == "system"
    assert hook["always_run"] and not hook["pass_filenames"]
