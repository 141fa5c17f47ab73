#!/bin/bash
# One large case in 3-D on many nodes: all ranks share it. From the project's folder:
#
#     sbatch studies/slurm-large.sh my.toml --set mesh.size_um=0.2
#     sbatch --nodes=2 --ntasks-per-node=16 --time=01:00:00 studies/slurm-large.sh my.toml
#
# Sized for 1e8 unknowns by what benchmarks/README.md measured and carries over from there ("1e8 unknowns"): about
# 0.8 TiB, and an hour. Reckon 8 kB an unknown over all nodes, twice as much on the first: Gmsh makes the mesh on rank 0.
# What a smaller mesh needs `--check` says; it makes the mesh for that.
#
#SBATCH --job-name=cellmech-large
#SBATCH --nodes=16
#SBATCH --ntasks-per-node=16
#SBATCH --cpus-per-task=1
#SBATCH --exclusive
#SBATCH --mem=0
#SBATCH --time=03:00:00
# SIGTERM half a minute before the end leaves time for the files to be closed.
#SBATCH --signal=TERM@30

set -euo pipefail

# The ranks are the parallelism: one thread each. Half the cores of a node may be as fast as all: memory is the limit.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# Where mpirun cannot start ranks on the nodes, `srun --mpi=pmix` does.
exec mpirun "${PYTHON:-.venv/bin/python}" -m cellmech.study "$@" --ranks-per-case "$SLURM_NTASKS"
