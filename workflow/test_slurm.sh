#!/usr/bin/env bash
# The workflow on a real SLURM of one node on this machine's loopback:
#   - a job over its memory is killed, and done with twice as much;
#   - a node that dies in the middle of a job, and comes back;
#   - recordings of a simulated person, the artifacts equal to those of `bsip run`.
# Needs root and Debian's packages slurmctld, slurmd, slurm-client and munge; exit code 77 without.
#
#   workflow/test_slurm.sh [BSIP] [SNAKEMAKE] [short]     short: without the recordings
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
bsip=$(realpath "${1:-$here/../.venv/bin/bsip}")
snakemake=$(realpath "${2:-$here/../.venv-cluster/bin/snakemake}")

skip() { echo "skipped: $1" >&2; exit 77; }
[ "$(id -u)" = 0 ] || skip "only root can start slurmd"
for program in slurmctld slurmd sbatch munged; do
    command -v $program > /dev/null || skip "there is no $program; Debian's packages slurmctld, slurmd, slurm-client and munge have it"
done
unshare --mount --pid --fork true 2> /dev/null || skip "no namespace of its own may be made here"
[ -x "$snakemake" ] || skip "there is no $snakemake; make .venv-cluster/ready installs it"

# Processes and mounts of its own: nothing is left behind, and /etc/slurm stays what it is.
[ -n "${APART:-}" ] || APART=1 exec unshare --mount --pid --fork --kill-child --mount-proc "$0" "$bsip" "$snakemake" "${3:-}"

work=$(mktemp -d)
export CALLS=$work/calls XDG_CACHE_HOME=$work
cd "$work"

# --- one node --------------------------------------------------------------------------------------

stop_node() {  # with all that runs on it
    pkill -KILL -F "$work/slurmd.pid"
    pkill -KILL slurmstepd
    for running in $(grep -l -a SLURM_JOB_ID /proc/[0-9]*/environ 2> /dev/null | cut -d / -f 3); do
        kill -KILL "$running" 2> /dev/null || true
    done
}

start_node() {
    slurmd -N "$node"
}

# Four processors whatever this machine has: with one, the second job would wait for ever.
node=$(hostname -s)
port=$((20000 + RANDOM % 20000))
cat > slurm.conf << END
ClusterName=loopback
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CryptoType=crypto/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=1
JobAcctGatherParams=OverMemoryKill
JobRequeue=0
KillWait=2
SlurmdTimeout=10
SlurmctldTimeout=30
ReturnToService=2
MpiDefault=none
NodeName=$node NodeAddr=127.0.0.1 CPUs=4 RealMemory=$(awk '/MemTotal/ {print int($2 / 1024)}' /proc/meminfo)
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
END
mkdir -p state spool bin
trap 'rm -rf "$work"' EXIT
mount --bind "$work" /etc/slurm
dd if=/dev/urandom of=munge.key bs=1 count=1024 status=none
chmod 400 munge.key
munged --force --key-file="$work/munge.key" --socket="$work/munge.socket" --pid-file="$work/munged.pid" \
    --log-file="$work/munged.log" --seed-file="$work/munge.seed"
slurmctld
start_node
is_idle() { [ "$(sinfo --noheader --format %T 2> /dev/null)" = idle ]; }
for _ in $(seq 30); do
    is_idle && break
    sleep 1
done
is_idle || { cat slurm*.log >&2; skip "SLURM does not start here"; }

over() {  # STUDY OUT BSIP: everybody, as workflow/README.md has it, checking often
    BSIP_STUDY=$1 BSIP_OUT=$2 BSIP=$3 "$snakemake" --snakefile "$here/Snakefile" --profile "$here/profiles/slurm" \
        --jobs 4 --latency-wait 5 --slurm-no-account --slurm-init-seconds-before-status-checks 3 \
        --slurm-status-command squeue --slurm-keep-successful-logs -- everybody
}

# --- what goes wrong on clusters -------------------------------------------------------------------

# In place of bsip: the first person takes 3.5 GB where 2.5 were asked for, the second hangs at the first try.
cat > bin/bsip << 'END'
#!/bin/sh
[ "$1" = people ] && exec printf 'sub-01\nsub-02\n'
case " $* " in *" --until "*) exit 0;; esac  # what they show of the laboratory
echo "$6" >> "$CALLS"
case "$6" in
    sub-01) python3 -c "import time; held = bytearray(3_500_000_000); time.sleep(8)" ;;
    sub-02) [ "$(grep -c sub-02 "$CALLS")" -gt 1 ] || exec sleep 3600 ;;
esac
END
chmod +x bin/bsip
touch "$CALLS"

(
    until [ -f out/.made/sub-01 ] && [ "$(squeue --noheader | wc -l)" = 1 ]; do sleep 1; done
    echo "--- the node dies"
    stop_node
    sleep 15
    start_node
    echo "--- and comes back"
) &
dying=$!
over study out "$work/bin/bsip" || { tail "$work"/slurm*.log; exit 1; }
wait $dying
times() { grep -c "$1" "$CALLS" || true; }
[ "$(times sub-02)" = 2 ] || { echo "the job on the dead node was tried $(times sub-02) times" >&2; exit 1; }
[ "$(times sub-01)" = 2 ] || { echo "the job over its memory was tried $(times sub-01) times" >&2; exit 1; }
grep -q "exceeded.*memory limit" slurmd.log || { echo "SLURM did not kill the job over its memory" >&2; exit 1; }
[ -f out/.made/sub-01 ] && [ -f out/.made/sub-02 ]
echo "passed: a job over its memory and a node that died"

[ "${3:-}" = short ] && exit 0

# --- the same artifacts ----------------------------------------------------------------------------

"$bsip" simulate real --participants 1 --sequence-s 10 --task static --task sequence > /dev/null
over real by_slurm "$bsip"
"$bsip" run real --out by_slurm --group
"$bsip" run real --out alone
rm -rf by_slurm/.made
diff -r --exclude .lock --exclude .fingerprints.json by_slurm alone
echo "passed: $(find alone -type f | wc -l) files equal to those of bsip run"
