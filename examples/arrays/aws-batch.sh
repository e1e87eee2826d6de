#!/bin/sh
# The command of a container in an array job of AWS Batch. WORK is a folder that all jobs see, on EFS
# or FSx, with case.toml and designs/.
#
#     aws batch submit-job --job-name designs --job-queue QUEUE --job-definition IDMESH \
#         --array-properties size=10 --retry-strategy attempts=3
#
# A job on a spot instance that is taken away is tried again, and goes on where it stopped.
set -eu
cd "${WORK:-/work}"
exec idmesh batch case.toml --designs designs --out moved --json "reports.$AWS_BATCH_JOB_ARRAY_INDEX.jsonl" \
    --resume --shard auto
