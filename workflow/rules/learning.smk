# learning: classifiers of images, one for each run and model, tested at every SNR.
# A run is an experiment; one that trains at each of several SNRs has a run for each, named <experiment>_snr_<n>dB.


rule train:
    input:
        stores=lambda w: plan.training_stores(w.root, w.run, w.model),
        members=lambda w: [
            f"{w.root}/learning/models/{w.run}/{member}" for member in experiments.members(plan.models, w.model)
        ],
    output:
        model=directory("{root}/learning/models/{run}/{model}"),
    log:
        "{root}/logs/learning/train/{run}/{model}.log",
    benchmark:
        "{root}/benchmarks/learning/train/{run}/{model}.tsv"
    # The longest jobs of learning: begun last, one would go on alone.
    priority: 1
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=lambda w: plan.megabytes(w.run, w.model),
    params:
        code=lambda w: code("job_train.py", *plan.model_files(w.model)),
        settings=lambda w: section(plan.seeded[w.root], f"learning.models.{w.model}", "seed")
        | plan.of_targets(plan.trained_targets(w.run, w.model))
        | {"run": section(plan.runs_of[w.root][w.run], *experiments.LEARNED)},
    message:
        "train {wildcards.run}/{wildcards.model} (progress in {log})"
    script:
        "../scripts/job_train.py"


# One job of a model for all SNRs of a set, as for their images; experiments that test at some of them have another rule.
TESTS = [(number, *of) for number, snrs in enumerate(SNR_SETS, 1) for of in plan.tests(snrs).items()]
for rule_number, (number, snrs, runs) in enumerate(TESTS, 1):

    rule:
        name:
            f"predict{numbered(rule_number, '_')}"
        input:
            stores=lambda w, snrs=snrs: expand(
                f"{w.root}/{plan.folder(w.run)}/{{target}}/{{snr}}.zarr",
                target=[] if plan.added(w.model) else plan.tested_targets(w.run),
                snr=snrs,
            ),
            added=lambda w, snrs=snrs: expand(
                f"{w.root}/learning/predictions/{w.run}/{{member}}/{{snr}}.csv", member=plan.added(w.model), snr=snrs
            ),
            model=rules.train.output.model,
        output:
            tables=expand("{{root}}/learning/predictions/{{run}}/{{model}}/{snr}.csv", snr=snrs),
        log:
            f"{{root}}/logs/learning/predict/{{run}}/{{model}}{numbered(number, '-')}.log",
        benchmark:
            f"{{root}}/benchmarks/learning/predict/{{run}}/{{model}}{numbered(number, '-')}.tsv"
        wildcard_constraints:
            run=one_of(runs),
        conda:
            "../../envs/learning.yaml"
        threads: 1
        resources:
            mem_mb=lambda w: plan.megabytes(w.run, w.model),
            runtime=lambda w, attempt: 240 * attempt,  # minutes a cluster gives it, as its name may have a number
        params:
            code=lambda w: code("job_predict.py", *plan.model_files(w.model)),
            settings=lambda w: plan.of_targets(plan.tested_targets(w.run))
            | {"is_open": plan.runs[w.run]["open"], "realizations": plan.tested_realizations()},
        message:
            f"predict {{wildcards.run}}/{{wildcards.model}} at {experiments.labels_in_words(snrs)}"
        script:
            "../scripts/job_predict.py"


# For the page: some images, and what a model with a decoder makes of them.
rule reconstruct:
    input:
        stores=lambda w: expand(
            f"{RESULTS}/imaging/{{target}}/{{snr}}.zarr",
            target=[*plan.known, *plan.unknown],
            snr=["clean", *map(snr_label, selection.decoded_snrs(config["noise"]["snr_db"]))],
        ),
        model=f"{RESULTS}/learning/models/{{run}}/{{model}}",
    output:
        reconstructions=directory(f"{RESULTS}/learning/reconstructions/{{run}}/{{model}}.zarr"),
    log:
        f"{RESULTS}/logs/learning/reconstruct/{{run}}/{{model}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/reconstruct/{{run}}/{{model}}.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        code=lambda w: code("job_reconstruct.py", *plan.model_files(w.model)),
        settings=plan.of_targets([*plan.known, *plan.unknown]),
    message:
        "reconstruct {wildcards.run}/{wildcards.model}: some images and what it makes of them"
    script:
        "../scripts/job_reconstruct.py"


rule timing:
    input:
        stores=expand(f"{RESULTS}/imaging/{{target}}/clean.zarr", target=plan.known),
        models=expand(f"{RESULTS}/learning/models/{{fitted}}", fitted=plan.timed),
    output:
        times=in_report(f"{RESULTS}/learning/times.json", "Learning", table="prediction times"),
    log:
        f"{RESULTS}/logs/learning/timing.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/timing.tsv"
    # After what may run side by side, as it waits until all cores are free.
    priority: -1
    conda:
        "../../envs/learning.yaml"
    # All cores, so that nothing else runs at the same time. On a cluster one: a job there is told of all its node's.
    threads: 1 if workflow.remote_exec else workflow.resource_settings.cores or 1
    resources:
        mem_mb=plan.most_megabytes(plan.timed, 1000),
    params:
        code=code("job_timing.py", *plan.model_files(*plan.fitted)),
        settings=plan.of_targets(plan.known),
    message:
        "timing of every model: alone on all cores"
    script:
        "../scripts/job_timing.py"


rule scores:
    input:
        predictions=plan.predictions("{root}"),
    output:
        scores=in_report("{root}/learning/scores.csv", "Learning", table="scores"),
        confusion=in_report("{root}/learning/confusion.csv", "Learning", table="confusion"),
        validation=in_report("{root}/learning/validation.csv", "Learning", table="validation"),
        record="{root}/learning/scores.json",
    log:
        "{root}/logs/learning/scores.log",
    benchmark:
        "{root}/benchmarks/learning/scores.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 8
    resources:
        mem_mb=lambda w, threads: 500 + 500 * threads,
    params:
        code=code("job_scores.py"),
        settings=lambda w: section(plan.seeded[w.root], "learning.kept", "noise.definition", "seed")
        | {"runs": {name: section(run, *experiments.LEARNED) for name, run in plan.runs_of[w.root].items()}}
        | {"track": plan.track(), **plan.families()},
    message:
        "scores of all predictions (progress in {log})"
    script:
        "../scripts/job_scores.py"


# Every method at every SNR in one table, to compare others with (docs/benchmark.md).
rule benchmark:
    input:
        scores=f"{RESULTS}/learning/scores.csv",
    output:
        leaderboard=in_report(f"{RESULTS}/learning/leaderboard.csv", "Learning", table="leaderboard"),
    log:
        f"{RESULTS}/logs/learning/benchmark.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/benchmark.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        code=code("job_benchmark.py"),
        settings=section(config, "noise.definition"),
    message:
        "benchmark: the leaderboard of all methods"
    script:
        "../scripts/job_benchmark.py"


# With several seeds: how far what they reach differs.
rule seeds:
    input:
        scores=expand("{root}/learning/scores.csv", root=plan.seeded),
    output:
        in_report(f"{RESULTS}/learning/seeds.csv", "Learning", table="scores over seeds"),
    log:
        f"{RESULTS}/logs/learning/seeds.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/seeds.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        code=code("job_seeds.py"),
    message:
        f"seeds: scores over {len(plan.seeded)} seeds"
    script:
        "../scripts/job_seeds.py"


# Images as plain arrays, for programs that know nothing of this one.
rule export_hdf5:
    input:
        stores=expand(f"{RESULTS}/imaging/{{target}}/{{{{images}}}}.zarr", target=plan.targets),
    output:
        f"{RESULTS}/learning/export/{{images}}.h5",
    log:
        f"{RESULTS}/logs/learning/export/{{images}}-h5.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/export/{{images}}-h5.tsv"
    wildcard_constraints:
        images=one_of(["clean", *plan.snrs]),
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=lambda w: 500 + 3 * len(plan.targets) * plan.image_megabytes(config["noise"]["realizations"]),
    params:
        code=code("job_export.py"),
        settings=lambda w: section(config, "imaging.aperture", "learning.split", "seed") | plan.of_targets(plan.targets),
    message:
        "export the images of all targets, {wildcards.images}: {output}"
    script:
        "../scripts/job_export.py"


use rule export_hdf5 as export_zarr with:
    output:
        directory(f"{RESULTS}/learning/export/{{images}}.zarr"),
    log:
        f"{RESULTS}/logs/learning/export/{{images}}-zarr.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/export/{{images}}-zarr.tsv"
