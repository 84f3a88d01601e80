#!/usr/bin/env bash
# Tries deploy/slurm on a Slurm of one node that it starts itself: the coordinator as a batch job, one
# worker, three, one again of which another is taken away in the middle, the coordinator queued again;
# the image must be that of `lucerna render`.
#   try_slurm.sh BIN      (as root, with Debian's slurm-wlm and munge; 77 when they are not there)
set -euo pipefail
bin=$(realpath "$1")
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
for program in munged slurmctld slurmd sbatch scancel scontrol squeue; do
  command -v "$program" > /dev/null || { echo "$program is not installed"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "needs root"; exit 77; }
folder=$(mktemp -d)
started=()
cleanup() {
  code=$?
  export SLURM_CONF=$folder/slurm.conf
  scancel --quiet --user=root 2> /dev/null || true
  sleep 1
  for process in "${started[@]}"; do kill "$process" 2> /dev/null || true; done
  wait 2> /dev/null || true
  if [ "$code" = 0 ]; then rm -rf "$folder"; else echo "kept: $folder"; fi
}
trap cleanup EXIT

# A key of its own, so that nothing of the machine's is used.
head -c 1024 /dev/urandom > "$folder/munge.key"
chmod 400 "$folder/munge.key"
munged --foreground --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
  --log-file="$folder/munged.log" --seed-file="$folder/munged.seed" 2> /dev/null &
started+=($!)
host=$(hostname -s)
cpus=$(nproc)
cat > "$folder/slurm.conf" <<CONF
ClusterName=lucerna
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=17817
SlurmdPort=17818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
StateSaveLocation=$folder/ctld
SlurmdSpoolDir=$folder/slurmd
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
KillWait=20
MpiDefault=none
SchedulerParameters=bf_interval=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=$((cpus + 6)) State=UNKNOWN
PartitionName=farm Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
sed -i "s/CPUs=$((cpus + 6))/CPUs=$((cpus + 6)) RealMemory=1000/" "$folder/slurm.conf"
# More processors than there are: workers of this test have one each.
echo "SlurmdParameters=config_overrides" >> "$folder/slurm.conf"
mkdir -p "$folder/ctld" "$folder/slurmd"
export SLURM_CONF=$folder/slurm.conf
sleep 1
slurmctld -D > /dev/null 2>&1 &
started+=($!)
slurmd -D -N "$host" > /dev/null 2>&1 &
started+=($!)
for _ in $(seq 30); do sinfo -h -o %t 2> /dev/null | grep -q '^idle' && break; sleep 1; done
sinfo -h -o %t | grep -q '^idle' || { echo "Slurm did not start"; tail -5 "$folder"/*.log; exit 1; }

export LUCERNA_DIR=$folder/farm LUCERNA_BIN=$bin LUCERNA_PORT=17400
mkdir -p "$LUCERNA_DIR"
cd "$folder"
at=127.0.0.1:$LUCERNA_PORT
submit() { sbatch --parsable --export=ALL --mem=10 "$@"; }
coordinator=$(submit "$root/deploy/slurm/coordinator.sbatch")
for _ in $(seq 60); do [ -s "$LUCERNA_DIR/address" ] && break; sleep 0.5; done
# The node's own name may not lead to it here.
echo "$at" > "$LUCERNA_DIR/address"
workers_there() {
  for _ in $(seq 120); do
    [ "$("$bin/lucerna" workers --server "$at" --json 2> /dev/null | grep -c '"is_connected": true')" = "$1" ] && return 0
    sleep 0.5
  done
  echo "there are not $1 workers"; "$bin/lucerna" workers --server "$at" || true; squeue; return 1
}
scene=$root/tests/scenes/corner.pbrt
flags=(--size 160x120 --passes 1500)
first=$(submit --array=1 --cpus-per-task=1 "$root/deploy/slurm/workers.sbatch")
workers_there 1
job=$("$bin/lucerna" submit "$scene" "${flags[@]}" --server "$at" --json | sed -n 's/.*"job_id": "\(.*\)".*/\1/p')
more=$(submit --array=1-2 --cpus-per-task=1 "$root/deploy/slurm/workers.sbatch")
workers_there 3
state() { "$bin/lucerna" jobs --server "$at" --json | sed -n 's/.*"state": "\(.*\)".*/\1/p' | head -1; }
[ "$(state)" = RUNNING ] || { echo "the job ended before anything was tried: $(state)"; exit 1; }
# One is preempted, and comes back; then the coordinator is; then two leave for good.
scontrol requeue "${more}_1"
scontrol requeue "$coordinator"
workers_there 3
scancel "$more"
workers_there 1
[ "$(state)" = RUNNING ] || { echo "the job ended before all was tried: $(state)"; exit 1; }
"$bin/lucerna" wait "$job" --server "$at" > /dev/null
"$bin/lucerna" fetch "$job" --server "$at" -o farm.exr --quiet
"$bin/lucerna" render "$scene" "${flags[@]}" -o alone.exr --quiet
farm=$("$bin/lucerna" digest farm.exr)
alone=$("$bin/lucerna" digest alone.exr)
echo "farm:  $farm"
echo "alone: $alone"
[ "${farm%% *}" = "${alone%% *}" ] || { echo "the images differ"; exit 1; }
scancel "$first" "$coordinator"
echo "Slurm: one worker, three, one; a worker and the coordinator queued again; the same image"
