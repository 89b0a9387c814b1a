# mesh: a CAD file becomes, for every frequency band, a cleaned mesh of lambda/10 edges.


rule mesh:
    output:
        measures=in_report(f"{FIELDS}/mesh/{{target}}.json", "Meshes", target="{target}"),
        source=f"{FIELDS}/mesh/{{target}}-source.ply",
        meshes=[f"{FIELDS}/mesh/{{target}}-{band}.ply" for band in plan.bands],
    log:
        f"{FIELDS}/logs/mesh/{{target}}.log",
    benchmark:
        f"{FIELDS}/benchmarks/mesh/{{target}}.tsv"
    wildcard_constraints:
        target=one_of(plan.meshed),
    priority: learned_first
    conda:
        "../../envs/mesh.yaml"
    threads: 1
    resources:
        mem_mb=4000,
    params:
        code=code("job_mesh.py"),
        cad=lambda w: cad_of(config["targets"][w.target]),
        files=lambda w: source_of(w.target),
        settings=lambda w: {
            "radar": section(config["radar"], "bandwidth", "center_frequency", "frequencies"),
            "mesh": section(
                needs.mesh_of(config, w.target),
                *{"bands", "edges_per_wavelength", "index", "remesh"}.intersection(needs.mesh_of(config, w.target)),
            ),
            "target": section(
                config["targets"][w.target],
                *{"family", "length", "rotate", "scale", "symmetry", "translate", "unit"}.intersection(
                    config["targets"][w.target]
                ),
            )
            | parts_of(w.target),
        },
    message:
        "mesh {wildcards.target}: clean and remesh {params.cad}"
    script:
        "../scripts/job_mesh.py"


# On demand: what the CAD files are and what would become of them, without making it.
rule check:
    output:
        f"{RESULTS}/check.txt",
    log:
        f"{RESULTS}/logs/check.log",
    benchmark:
        f"{RESULTS}/benchmarks/check.tsv"
    conda:
        "../../envs/mesh.yaml"
    threads: 1
    resources:
        mem_mb=4000,
    params:
        code=code("job_check.py", plan.solver_file()),
        settings=section(config, "aspect", "mesh", "radar", "scattering", "targets"),
        targets=sorted(plan.meshed),
        asked=time.time(),  # another one every time: who asks again wants to read it again
    message:
        "check: look at the CAD files of {params.targets} ({output})"
    script:
        "../scripts/job_check.py"
