# mesh: a CAD file becomes, for every frequency band, a cleaned mesh of lambda/10 edges.
# takes: targets.<target>.mesh            makes: mesh/<target>.json, mesh/<target>-<band>.ply


rule mesh:
    input:
        cad=lambda w: config["targets"][w.target]["mesh"],
        code=code("mesh"),
    output:
        figures=f"{RESULTS}/mesh/{{target}}.json",
        meshes=[f"{RESULTS}/mesh/{{target}}-{band}.ply" for band in BANDS],
    log:
        f"{RESULTS}/logs/mesh/{{target}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/mesh/{{target}}.tsv"
    conda:
        "../../envs/mesh.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        settings=lambda w: {
            "mesh": section(config["mesh"], "bands", "edges_per_wavelength"),
            "radar": section(config["radar"], "bandwidth", "center_frequency", "frequencies"),
            "target": section(
                config["targets"][w.target],
                *{"rotate", "symmetry", "unit"}.intersection(config["targets"][w.target]),
            ),
        },
    message:
        "mesh {wildcards.target}: clean and remesh {input.cad}"
    script:
        "../scripts/mesh/job_mesh.py"
