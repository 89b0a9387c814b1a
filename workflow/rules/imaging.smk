# imaging: a field over frequency and azimuth becomes ISAR images, clean and at every SNR; and images of noise alone, for
# models that learn a class 'other'.


rule image:
    input:
        field=lambda w: for_images(f"{FIELDS}/scattering/{w.target}.zarr"),
    output:
        directory(f"{RESULTS}/imaging/{{target}}/clean.zarr"),
    log:
        f"{RESULTS}/logs/imaging/{{target}}/clean.log",
    benchmark:
        f"{RESULTS}/benchmarks/imaging/{{target}}/clean.tsv"
    conda:
        "../../envs/imaging.yaml"
    threads: 1
    resources:
        mem_mb=lambda w: plan.image_megabytes(1),
    params:
        code=code("job_image.py", plan.imager_file()),
        settings=section(unfocused(config), "imaging"),
    message:
        "imaging {wildcards.target}: form the clean images"
    script:
        "../scripts/job_image.py"


# One job for all SNRs, as the images of one take less time than a job's start. Those that come into the config later are
# sets of their own (`setup.snr_sets`), so that adding one makes its images alone. Experiments with a motion of their own
# have images of their own, at the SNRs that they test.
# One thread: the last bits of a product depend on how many BLAS uses.
NOISES = [(number, *of) for number, snrs in enumerate(SNR_SETS, 1) for of in plan.noises(snrs).items()]
for rule_number, (number, snrs, folders) in enumerate(NOISES, 1):

    rule:
        name:
            f"noise{numbered(rule_number, '_')}"
        input:
            field=lambda w: for_images(f"{FIELDS}/scattering/{w.target}.zarr"),
        output:
            [directory(f"{{root}}/{{folder}}/{{target}}/{snr}.zarr") for snr in snrs],
        log:
            f"{{root}}/logs/{{folder}}/{{target}}/noise{numbered(number, '-')}.log",
        benchmark:
            f"{{root}}/benchmarks/{{folder}}/{{target}}/noise{numbered(number, '-')}.tsv"
        wildcard_constraints:
            folder=one_of(folders),
        conda:
            "../../envs/imaging.yaml"
        threads: 1
        resources:
            mem_mb=lambda w: plan.image_megabytes(config["noise"]["realizations"]),
            runtime=lambda w, attempt: 240 * attempt,  # minutes a cluster gives it, as its name may have a number
        params:
            code=code("job_noise.py", plan.imager_file(), plan.focus_file()),
            settings=lambda w: section(
                plan.seeded[w.root], "imaging", "noise.definition", "noise.per", "noise.realizations", "seed"
            )
            | {"motion": plan.motions[w.folder]},
        message:
            f"imaging {{wildcards.target}}: form the images at {experiments.labels_in_words(snrs)}"
        script:
            "../scripts/job_noise.py"


rule pure_noise:
    output:
        directory(f"{{root}}/imaging/{PURE_NOISE}/clean.zarr"),
    log:
        f"{{root}}/logs/imaging/{PURE_NOISE}/clean.log",
    benchmark:
        f"{{root}}/benchmarks/imaging/{PURE_NOISE}/clean.tsv"
    conda:
        "../../envs/imaging.yaml"
    threads: 1
    resources:
        mem_mb=lambda w: plan.image_megabytes(1),
    params:
        code=code("job_pure_noise.py", plan.imager_file()),
        settings=lambda w: section(unfocused(plan.seeded[w.root]), "aspect", "imaging", "radar", "seed"),
    message:
        "imaging: form images of noise alone"
    script:
        "../scripts/job_pure_noise.py"
