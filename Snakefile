"""isarflow: from CAD meshes to radar target recognition. `snakemake --cores 2 report` makes everything."""

import os
import sys

from snakemake.exceptions import WorkflowError

SCRIPTS = os.path.join(workflow.basedir, "workflow", "scripts")
sys.path.insert(0, SCRIPTS)
# Jobs are processes of their own, here and on a cluster: each parses this file and inherits the path.
os.environ["PYTHONPATH"] = SCRIPTS + os.pathsep + os.environ.get("PYTHONPATH", "")

from common import radar as sweep
from common.config import images_are_made, load, section
from common.errors import InputError

try:
    config = load(config)
except InputError as error:
    raise WorkflowError(str(error)) from None

RESULTS = f"results/{config['name']}"
TARGETS = list(config["targets"])
BANDS = range(config["mesh"]["bands"])
SNRS = [sweep.snr_label(snr) for snr in config["noise"]["snr_db"]]


wildcard_constraints:
    target="[A-Za-z][A-Za-z0-9_]*",
    band="[0-9]+",
    experiment="[A-Za-z][A-Za-z0-9_]*",
    model="[A-Za-z][A-Za-z0-9_]*",
    snr=r"snr_-?[0-9.e+-]+dB",


def code(*stages):
    """The modules of these stages and the common ones. As inputs they rerun a job when their content changes."""
    return [
        os.path.relpath(os.path.join(SCRIPTS, stage, module))
        for stage in sorted({"common", *stages})
        for module in sorted(os.listdir(os.path.join(SCRIPTS, stage)))
        if module.endswith((".py", ".html", ".css", ".js"))
    ]


include: "workflow/rules/mesh.smk"
include: "workflow/rules/scattering.smk"
include: "workflow/rules/imaging.smk"
include: "workflow/rules/learning.smk"
include: "workflow/rules/report.smk"


localrules:
    all,


rule all:
    default_target: True
    input:
        rules.report.output,
