# isarflow: from CAD meshes to radar target recognition. `snakemake --cores 2 report` makes everything.


include: "workflow/rules/common.smk"


wildcard_constraints:
    target="[A-Za-z][A-Za-z0-9_]*",
    band="[0-9]+",
    experiment="[A-Za-z][A-Za-z0-9_]*",
    model="[A-Za-z][A-Za-z0-9_]*",
    snr=r"snr_-?[0-9.]+(e-[0-9]+)?dB",


include: "workflow/rules/mesh.smk"
include: "workflow/rules/scattering.smk"
include: "workflow/rules/imaging.smk"
include: "workflow/rules/learning.smk"
include: "workflow/rules/report.smk"


localrules:
    all,


onstart:
    lock.take()


rule all:
    default_target: True
    input:
        rules.report.output,
