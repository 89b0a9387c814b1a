# C. Stewart-Burger's thesis (Stellenbosch University, 2023), figure by figure: what it published beside a run's own.
# takes: scores, predictions, networks and images of the run
# makes: report/thesis/README.md, report/thesis/*.png
# It is no stage: nothing else takes what it makes.

STUDY = "studies/stewart-burger-2023"
sys.path.append(os.path.join(workflow.basedir, STUDY))

from study.selection import images_of, networks_of

# Its files.
MODULES = sorted(Path(workflow.basedir, STUDY, "study").glob("*.py"))
STUDY_CODE = [f"{STUDY}/{name}" for name in ("job_page.py", *(f"study/{path.name}" for path in MODULES))]
# Run and model of the networks that are judged anew.
JUDGED = [f"{run}/{model}" for run, model in networks_of(plan.runs)]


# Takes what the run has: what it does not have, the page names.
rule thesis_page:
    input:
        scores=rules.report.input.scores,
        times=rules.report.input.times,
        models=rules.report.input.curves,
        reconstructions=rules.report.input.reconstructions,
        predictions=expand(f"{RESULTS}/learning/predictions/{{fitted}}/{{snr}}.csv", fitted=JUDGED, snr=plan.snrs),
        images=[
            f"{RESULTS}/imaging/{target}/{images}.zarr"
            for target, images in (images_of(config, plan.runs) if images_are_made(config) else ())
        ],
    output:
        page=directory(f"{RESULTS}/report/thesis"),
    log:
        f"{RESULTS}/logs/thesis_page.log",
    benchmark:
        f"{RESULTS}/benchmarks/thesis_page.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 1
    resources:
        # A network classifies all of a target's images at an SNR.
        mem_mb=plan.most_megabytes(JUDGED, 2000),
    params:
        code=code(*STUDY_CODE, *plan.model_files(*JUDGED)),
        files=lambda w: contents_of(
            in_repository(STUDY, "page.yaml"),
            *published("results", "prediction_times", "confusion", "settings"),
            *(in_repository("resources/results", name) for name in ("models.csv.xz", "capsule_training.csv")),
        ),
        settings=section(config, *config),
        stated=page_names(plan.models),
    message:
        "thesis_page: write {output.page}/README.md (progress in {log})"
    script:
        "job_page.py"
