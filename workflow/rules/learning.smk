# learning: classifiers of images, one per experiment and model, tested at every SNR.
# takes: imaging/<target>/clean.zarr, imaging/<target>/snr_<n>dB.zarr of the known targets
# makes: learning/models/<experiment>/<model>/, learning/predictions/<experiment>/<model>/snr_<n>dB.csv,
#        learning/times/<experiment>/<model>.json, learning/scores.csv, learning/confusion.csv

EXPERIMENTS = config["learning"]["experiments"] if images_are_made(config) else {}
RUNS = [f"{experiment}/{model}" for experiment in EXPERIMENTS for model in EXPERIMENTS[experiment]["models"]]
KNOWN = sorted(name for name, target in config["targets"].items() if target["role"] == "known")
TRAINING_IMAGES = {
    experiment: "clean" if settings["train"]["snr_db"] == "clean" else sweep.snr_label(settings["train"]["snr_db"])
    for experiment, settings in EXPERIMENTS.items()
}


rule train:
    input:
        stores=lambda w: expand(f"{RESULTS}/imaging/{{target}}/{TRAINING_IMAGES[w.experiment]}.zarr", target=KNOWN),
        code=code("learning"),
        model_code=f"{os.path.relpath(SCRIPTS)}/learning/models/{{model}}.py",
    output:
        model=directory(f"{RESULTS}/learning/models/{{experiment}}/{{model}}"),
    log:
        f"{RESULTS}/logs/learning/train/{{experiment}}/{{model}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/train/{{experiment}}/{{model}}.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=3000,
    params:
        settings=lambda w: section(
            config,
            f"learning.experiments.{w.experiment}.train",
            f"learning.models.{w.model}",
            "learning.split",
            "seed",
        ),
    message:
        "train {wildcards.experiment}/{wildcards.model}"
    script:
        "../scripts/learning/job_train.py"


rule predict:
    input:
        stores=expand(f"{RESULTS}/imaging/{{target}}/{{{{snr}}}}.zarr", target=KNOWN),
        model=rules.train.output.model,
        code=code("learning"),
        model_code=rules.train.input.model_code,
    output:
        table=f"{RESULTS}/learning/predictions/{{experiment}}/{{model}}/{{snr}}.csv",
    log:
        f"{RESULTS}/logs/learning/predict/{{experiment}}/{{model}}/{{snr}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/predict/{{experiment}}/{{model}}/{{snr}}.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    message:
        "predict {wildcards.experiment}/{wildcards.model} at {wildcards.snr}"
    script:
        "../scripts/learning/job_predict.py"


rule timing:
    input:
        stores=expand(f"{RESULTS}/imaging/{{target}}/clean.zarr", target=KNOWN),
        model=rules.train.output.model,
        code=code("learning"),
        model_code=rules.train.input.model_code,
    output:
        times=f"{RESULTS}/learning/times/{{experiment}}/{{model}}.json",
    log:
        f"{RESULTS}/logs/learning/timing/{{experiment}}/{{model}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/timing/{{experiment}}/{{model}}.tsv"
    conda:
        "../../envs/learning.yaml"
    # All cores, so that nothing else runs at the same time. Without a number (on a cluster) one.
    threads: workflow.resource_settings.cores or 1
    resources:
        mem_mb=1500,
    message:
        "timing {wildcards.experiment}/{wildcards.model}: alone on all cores"
    script:
        "../scripts/learning/job_timing.py"


rule scores:
    input:
        predictions=expand(f"{RESULTS}/learning/predictions/{{run}}/{{snr}}.csv", run=RUNS, snr=SNRS),
        code=code("learning"),
    output:
        scores=f"{RESULTS}/learning/scores.csv",
        confusion=f"{RESULTS}/learning/confusion.csv",
    log:
        f"{RESULTS}/logs/learning/scores.log",
    benchmark:
        f"{RESULTS}/benchmarks/learning/scores.tsv"
    conda:
        "../../envs/learning.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        settings=lambda w: section(config, "learning.experiments", "learning.split.scheme", "seed"),
    message:
        "scores of all predictions"
    script:
        "../scripts/learning/job_scores.py"
