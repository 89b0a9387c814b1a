# imaging: a field over frequency and azimuth becomes ISAR images, clean and at every SNR.
# takes: scattering/<target>.zarr, mesh/<target>.json (of a target that is a mesh)
# makes: imaging/<target>/clean.zarr, imaging/<target>/snr_<n>dB.zarr,
#        imaging/pure-noise/clean.zarr for models that learn a class 'other'


rule image:
    input:
        field=lambda w: for_images(f"{FIELDS}/scattering/{w.target}.zarr"),
        mesh=lambda w: f"{FIELDS}/mesh/{w.target}.json" if w.target in MESHED else [],
        code=code("imaging/job_image.py") + imager_code(),
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
        mem_mb=lambda w: image_megabytes(1),
    params:
        settings=section(config, "imaging"),
    message:
        "imaging {wildcards.target}: form the clean images"
    script:
        "../scripts/imaging/job_image.py"


# The SNR is in the file's name, so that adding one to the config runs only its own jobs.
# One thread: the last bits of a product depend on how many BLAS uses.
rule noise:
    input:
        field=lambda w: for_images(f"{FIELDS}/scattering/{w.target}.zarr"),
        code=code("imaging/job_noise.py") + imager_code(),
    output:
        directory("{root}/imaging/{target}/{snr}.zarr"),
    log:
        "{root}/logs/imaging/{target}/{snr}.log",
    benchmark:
        "{root}/benchmarks/imaging/{target}/{snr}.tsv"
    conda:
        "../../envs/imaging.yaml"
    threads: 1
    resources:
        mem_mb=lambda w: image_megabytes(config["noise"]["realizations"]),
    params:
        settings=lambda w: section(
            SEEDED[w.root], "imaging", "noise.definition", "noise.per", "noise.realizations", "seed"
        ),
    message:
        "imaging {wildcards.target}: form the images at {wildcards.snr}"
    script:
        "../scripts/imaging/job_noise.py"


rule pure_noise:
    input:
        code=code("imaging/job_pure_noise.py") + imager_code(),
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
        mem_mb=lambda w: image_megabytes(1),
    params:
        settings=lambda w: section(SEEDED[w.root], "aspect", "imaging", "radar", "seed"),
    message:
        "imaging: form images of noise alone"
    script:
        "../scripts/imaging/job_pure_noise.py"
