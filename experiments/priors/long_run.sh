#!/usr/bin/env bash
# Trains everything on all kinds, one after the other, in a thread of its own. Stop it at any time:
# the same command goes on where it was, and does nothing more once all is trained.
#
#     setsid nohup nice -n 19 bash experiments/priors/long_run.sh FOLDER > FOLDER/long_run.log 2>&1 &
#
# FOLDER holds `prepared` (README.md) and gets `runs/`.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=$(realpath "$1")
export XLA_FLAGS="--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
python=.venv/bin/python

$python -m experiments.priors.train_autoencoder --data "$folder/prepared" \
  --run "$folder/runs/autoencoder"
if [ ! -e "$folder/runs/latents.npz" ]; then
  $python -m experiments.priors.encode --data "$folder/prepared" \
    --autoencoder "$folder/runs/autoencoder" "$folder/runs/latents.npz"
fi
$python -m experiments.priors.train_latents --latents "$folder/runs/latents.npz" \
  --autoencoder "$folder/runs/autoencoder" --run "$folder/runs/latents"
$python -m experiments.priors.train_pixels --data "$folder/prepared" \
  --run "$folder/runs/pixels"
