# isarflow: from CAD meshes to radar target recognition. `snakemake --cores 2 report` makes everything.


include: "workflow/rules/common.smk"


# What `snakemake --report` writes on its first page.
report: "workflow/report/workflow.rst"


# Only what the config names: any other artefact is one that no rule makes.
wildcard_constraints:
    target=one_of(config["targets"]),
    band="[0-9]+",
    run=one_of(plan.runs),
    model=one_of(plan.models),
    snr=one_of(plan.snrs),
    root=one_of(plan.seeded),


include: "workflow/rules/mesh.smk"
include: "workflow/rules/scattering.smk"
include: "workflow/rules/imaging.smk"
include: "workflow/rules/learning.smk"
include: "workflow/rules/report.smk"
include: "studies/stewart-burger-2023/study.smk"


localrules:
    all,
    export,


onstart:
    # On a cluster other machines solve; `check` says of every target what would refuse it.
    say_what_is_expected(refuse=workflow.local_exec and set(workflow.dag_settings.targets) != {"check"})
    or_exit(lock.take, RESULTS, not workflow.local_exec)
    if plan.runs:
        snr_sets.keep(RESULTS, SNR_SETS)
    if workflow.local_exec:
        # By its limit of jobs a second every job that begins has the scheduler look at all jobs again, each second to
        # the end of the run: half a core in the end. Here jobs begin as others end; a cluster's queue keeps the limit.
        workflow.scheduler.job_rate_limiter = None


# A dry-run has no onstart, and while this file is read Snakemake does not tell yet which run this is.
if workflow.is_main_process and {"-n", "--dry-run", "--dryrun"}.intersection(sys.argv):
    say_what_is_expected(refuse=False)


onsuccess:
    lock.leave()
    (checked,) = rules.check.output
    if {"check", checked}.intersection(workflow.dag_settings.targets):
        last = Path(checked).read_text().splitlines()[-1]
        if last.startswith("Error:"):  # `check` has done its job, and its file stays; the run ends in an error
            sys.exit(f"{last} ({checked} says why)")


onerror:
    lock.leave()


rule all:
    default_target: True
    input:
        rules.report.output,
        rules.seeds.output if plan.runs and len(plan.seeded) > 1 else [],
        expand(f"{RESULTS}/imaging/{{target}}/{{snr}}.zarr", target=plan.targets, snr=plan.snrs)
        if images_are_made(config)
        else [],


rule export:
    input:
        lambda w: for_images(
            expand(f"{RESULTS}/learning/export/{{images}}.{{form}}", images=["clean", *plan.snrs], form=["h5", "zarr"])
        ),
