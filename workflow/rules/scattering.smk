# scattering: a target's meshes become its backscatter over frequency and angle, one job for each frequency band.
# Beside them a sphere, solved with the same settings and compared with the Mie series for the report.
# A target that is given by its field has no mesh and no bands. Of a target that moves each pose but the first is solved
# as a target of its own.


rule solve:
    input:
        mesh=f"{FIELDS}/mesh/{{target}}-{{band}}.ply",
        measures=f"{FIELDS}/mesh/{{target}}.json",
    output:
        directory(f"{FIELDS}/scattering/bands/{{target}}-{{band}}.zarr"),
    log:
        f"{FIELDS}/logs/scattering/bands/{{target}}-{{band}}.log",
    benchmark:
        f"{FIELDS}/benchmarks/scattering/bands/{{target}}-{{band}}.tsv"
    wildcard_constraints:
        target=one_of(plan.meshed),
    priority: learned_first
    conda:
        "../../envs/scattering.yaml"
    threads: solve_threads
    resources:
        mem_mb=lambda w, input: STARTING + planned_solve(w, input)["megabytes"],
        runtime=solve_minutes,
    params:
        code=code("job_solve.py", plan.solver_file()),
        settings=lambda w: {
            **section(config, "aspect", "mesh.bands", "radar"),
            "scattering": method(w.target),
            "symmetry": plan.symmetry(w.target),
        },
    message:
        "scattering {wildcards.target}: solve band {wildcards.band} (progress in {log})"
    script:
        "../scripts/job_solve.py"


rule scattering:
    input:
        bands=[f"{FIELDS}/scattering/bands/{{target}}-{band}.zarr" for band in plan.bands],
        poses=lambda w: [f"{FIELDS}/scattering/{pose}.zarr" for pose in plan.poses(w.target)],
    output:
        directory(f"{FIELDS}/scattering/{{target}}.zarr"),
    log:
        f"{FIELDS}/logs/scattering/{{target}}.log",
    benchmark:
        f"{FIELDS}/benchmarks/scattering/{{target}}.tsv"
    wildcard_constraints:
        target=one_of(plan.meshed),
    # A second's work: not worth a place in a cluster's queue.
    localrule: True
    conda:
        "../../envs/scattering.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        code=code("job_scattering.py"),
    message:
        "scattering {wildcards.target}: join the bands, and the poses of one that moves"
    script:
        "../scripts/job_scattering.py"


rule field:
    output:
        directory(f"{FIELDS}/scattering/{{target}}.zarr"),
    log:
        f"{FIELDS}/logs/scattering/{{target}}.log",
    benchmark:
        f"{FIELDS}/benchmarks/scattering/{{target}}.tsv"
    wildcard_constraints:
        target=one_of(plan.given),
    # Before the long solves, so that a file that does not fit the sweep stops the run early.
    priority: 1
    conda:
        "../../envs/scattering.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        code=code("job_field.py"),
        files=lambda w: contents_of(*field_files.of_target(config["targets"][w.target])),
        settings=lambda w: section(config, "aspect", "radar")
        | section(
            config["targets"][w.target],
            "field",
            *{"symmetry", *field_files.STEPS} & config["targets"][w.target].keys(),
        ),
    message:
        "scattering {wildcards.target}: take the field from elsewhere"
    script:
        "../scripts/job_field.py"


rule sphere:
    output:
        f"{FIELDS}/scattering/check/sphere.json",
    log:
        f"{FIELDS}/logs/scattering/check/sphere.log",
    benchmark:
        f"{FIELDS}/benchmarks/scattering/check/sphere.tsv"
    # A second's work: not worth a place in a cluster's queue.
    localrule: True
    conda:
        "../../envs/scattering.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        code=code("job_sphere.py", plan.solver_file()),
        settings=section(
            config | {"scattering": needs.of_metal(config["scattering"])}, "mesh.edges_per_wavelength", "scattering"
        ),
    message:
        "scattering: solve a sphere and compare it with the Mie series"
    script:
        "../scripts/job_sphere.py"
