"""A Slurm of one node on this machine's loopback, in a folder of its own: nothing outside the folder is touched."""

import contextlib
import getpass
import importlib.util
import os
import re
import secrets
import shutil
import socket
import subprocess
import time

import psutil

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scontrol", "scancel")
PLUGIN = "snakemake_executor_plugin_slurm"
# Jobs are followed by their process tree and not confined: cgroups are not to be had in every container.
# The node claims twice its cores, since jobs that have two of them start on one.
# The controller remembers ended jobs for as long as it runs; there is no accounting database.
CONF = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={daemon}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SlurmdParameters=config_overrides
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=batch_sched_delay=0,sched_interval=2
MinJobAge=3600
KillWait=5
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={megabytes} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """Why no Slurm can be started here, or an empty text."""
    absent = [program for program in PROGRAMS if not _path(program)]
    if absent:
        return f"no {', '.join(absent)}: apt install slurm-wlm munge"
    if importlib.util.find_spec(PLUGIN) is None:
        return f"no {PLUGIN}: pip install --require-hashes -r envs/requirements-slurm.lock"
    return ""


@contextlib.contextmanager
def one_node(folder):
    """Run a Slurm in `folder` while the body runs; gives the environment in which its commands reach it."""
    for part in ("state", "spool"):
        (folder / part).mkdir()
    folder.chmod(0o755)  # munged wants its socket where every user may reach it
    key, conf = folder / "munge.key", folder / "slurm.conf"
    key.touch(0o600)
    key.write_bytes(secrets.token_bytes(128))
    controller, daemon = _free_ports(2)
    figures = {"host": socket.gethostname().split(".")[0], "user": getpass.getuser(), "folder": folder}
    figures |= {"cpus": 2 * os.cpu_count(), "megabytes": psutil.virtual_memory().total // 2**20}
    conf.write_text(CONF.format(controller=controller, daemon=daemon, **figures))
    munge = [f"--{name}={folder}/munge.{end}" for name, end in [("socket", "socket"), ("key-file", "key")]]
    munge += [f"--{name}={folder}/munged.{end}" for name, end in [("pid-file", "pid"), ("log-file", "log")]]
    munge += [f"--seed-file={folder}/munged.seed", "--force", "--num-threads=1"]
    with contextlib.ExitStack() as stack:
        stack.enter_context(_daemon(folder, "munged", "--foreground", *munge))
        _wait(lambda: (folder / "munge.socket").exists(), folder)
        stack.enter_context(_daemon(folder, "slurmctld", "-D", "-f", conf))
        stack.enter_context(_daemon(folder, "slurmd", "-D", "-f", conf))
        path = f"{_srun(folder)}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "SLURM_CONF": str(conf), "PATH": path}
        _wait(lambda: "idle" in _output(["sinfo", "--noheader", "--format=%T"], environment), folder)
        stack.callback(_end_jobs, environment)
        yield environment


def jobs(environment):
    """What the controller knows of all jobs: a dictionary of scontrol's keys for each."""
    text = _output(["scontrol", "--oneliner", "show", "jobs"], environment)
    return [dict(re.findall(r"(\S+?)=(\S*)", line)) for line in text.splitlines() if line.startswith("JobId=")]


def _srun(folder):
    """A folder with an srun that knows its Slurm: the executor plugin takes SLURM_CONF out of a job's environment."""
    (folder / "bin").mkdir()
    script = folder / "bin" / "srun"
    script.write_text(f'#!/bin/sh\nSLURM_CONF={folder}/slurm.conf exec {_path("srun")} "$@"\n')
    script.chmod(0o755)
    return script.parent


@contextlib.contextmanager
def _daemon(folder, program, *arguments):
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    with open(folder / f"{program}.out", "w") as log:
        process = subprocess.Popen([_path(program), *map(str, arguments)], stdout=log, stderr=log, env=environment)
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _end_jobs(environment):
    """End the jobs that a failed test left, and wait until their processes are gone."""
    subprocess.run(["scancel", "--user", getpass.getuser()], env=environment, check=False)
    deadline = time.monotonic() + 30
    while _output(["squeue", "--noheader"], environment) and time.monotonic() < deadline:
        time.sleep(0.2)


def _wait(ready, folder):
    deadline = time.monotonic() + 60
    while not ready():
        if time.monotonic() > deadline:
            raise TimeoutError("Slurm did not start:\n" + "\n".join(file.read_text() for file in folder.glob("*.out")))
        time.sleep(0.1)


def _output(command, environment):
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False).stdout


def _path(program):
    return shutil.which(program, path=f"{os.environ['PATH']}{os.pathsep}/usr/sbin")


def _free_ports(count):
    """Ports of the loopback that nothing listens on."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
