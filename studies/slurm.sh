#!/bin/bash
# A study as a Slurm job array: every task of the array solves its share of the cases, on MPI ranks of its own, into the
# same results folder. From the project's folder:
#
#     sbatch studies/slurm.sh studies/fig4.toml
#     sbatch --array=1-12 --time=02:00:00 studies/slurm.sh my.toml --out /scratch/my
#
# The array must count from 1 without gaps: task I of N takes cases I, I + N, I + 2N, ... No task waits for another;
# each ends by merging what is solved so far into summary.csv, so the last one leaves the table of all cases. A task that
# ran out of time goes on where it stopped when the same command is submitted again; what is finished is not solved twice.
#
#SBATCH --job-name=cellmech
#SBATCH --array=1-4
#SBATCH --ntasks=8
#SBATCH --cpus-per-task=1
#SBATCH --time=01:00:00
# Two to three hundred MB a rank for the default mesh; --check prints the memory a case needs.
#SBATCH --mem-per-cpu=1G
# SIGTERM half a minute before the end leaves time for the files to be closed.
#SBATCH --signal=TERM@30

set -euo pipefail

# The ranks are the parallelism: one thread each.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# Ranks take cases as they become free. With fewer cases in a task than ranks, the ranks of a task share them
# (--ranks-per-case sets how many). Where mpirun cannot start ranks on the nodes, `srun --mpi=pmix` does.
exec mpirun "${PYTHON:-.venv/bin/python}" -m cellmech.study "$@" \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
