#!/usr/bin/env bash
# Grades a class of 60 submissions on a Slurm of one node, started here, while a job is cancelled, one is requeued, the
# node is drained and resumed, and the disk is full for a while. The summary and the reports must be the bytes of a run
# without Slurm. Needs root and Debian's slurm-wlm and munge, which it installs; says what it skips.
set -euo pipefail
cd "$(dirname "$0")/.."

skip() {
    echo "slurm: skipped: $1"
    exit 0
}

[ "$(uname)" = Linux ] || skip "only on Linux"
[ "$(id -u)" = 0 ] || skip "only root can start a Slurm and mount a small file system"
if pidof slurmctld >/dev/null; then
    skip "a slurmctld is running already"
fi
missing=()
command -v slurmctld >/dev/null && command -v slurmd >/dev/null || missing+=(slurm-wlm)
command -v munged >/dev/null || missing+=(munge)
if [ "${#missing[@]}" -gt 0 ]; then
    echo "+ apt-get install ${missing[*]}"
    command -v apt-get >/dev/null || skip "no apt-get to install ${missing[*]}"
    { apt-get update -qq && apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null; } \
        || skip "${missing[*]} could not be installed"
fi

# The argument is the program to test.
grade=${1:-}
if [ -z "$grade" ]; then
    echo "+ cargo build --release --bin grade"
    cargo build --release --locked --quiet -p grade --bin grade
    grade=${CARGO_TARGET_DIR:-$PWD/target}/release/grade
fi

folder=$(mktemp -d)
started=()
cleanup() {
    # Only what this script started.
    scancel --full --user=root 2>/dev/null || true
    sleep 1
    for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait
    umount --lazy "$folder/out" 2>/dev/null || true
    rm -rf "$folder"
}
trap cleanup EXIT

# munged -> slurmctld -> slurmd, all with separate files.
export SLURM_CONF=$folder/slurm.conf
node=$(hostname -s)
socket=$folder/munge/socket
mkdir -p "$folder/munge" "$folder/state" "$folder/spool"
head -c 1024 /dev/urandom >"$folder/munge/key"
chown -R munge: "$folder/munge"
chmod 755 "$folder" "$folder/munge"
chmod 400 "$folder/munge/key"
cat >"$SLURM_CONF" <<END
ClusterName=test
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$socket
CryptoType=crypto/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=0
ReturnToService=2
KillWait=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
END
runuser -u munge -- munged --foreground --key-file="$folder/munge/key" --socket="$socket" \
    --pid-file="$folder/munge/pid" --log-file="$folder/munge/log" --seed-file="$folder/munge/seed" 2>/dev/null &
started+=($!)
for _ in $(seq 50); do [ -S "$socket" ] && break; sleep 0.1; done
slurmctld -D 2>/dev/null &
started+=($!)
slurmd -D -N "$node" 2>/dev/null &
started+=($!)
wait_for() {
    local what=$1
    shift
    for _ in $(seq 1200); do
        if "$@" >/dev/null 2>&1; then return; fi
        sleep 0.1
    done
    echo "slurm: $what did not happen within two minutes"
    tail -n 20 "$folder"/slurm*.log
    exit 1
}
is_idle() { sinfo --noheader --format=%T | grep -qx idle; }
wait_for "an idle node" is_idle

# 60 submissions: correct, wrong, crashing, and some equal ones.
cd "$folder"
mkdir -p assets/Free class
for scene in near:1.5:explicit-euler far:150:explicit-euler other:3:symplectic-euler; do
    IFS=: read -r name x method <<<"$scene"
    cat >"assets/Free/$name.xml" <<END
<scene>
  <duration time="0.2"/>
  <integrator type="$method" dt="0.1"/>
  <particle m="1.25" px="$x" py="0" vx="1" vy="2" fixed="0"/>
</scene>
END
done
"$grade" oracle regenerate --accept --root . >/dev/null
for number in $(seq -w 1 60); do
    mkdir "class/s$number"
    printf 'run = ["sh", "{folder}/run", "{scene}", "{trace}"]\n' >"class/s$number/submission.toml"
    case $((10#$number % 10)) in
    1) step='x += 2 * dt * vx' ;;
    2) step='exit 3' ;;
    *) step='x += dt * vx' ;;
    esac
    # Those with numbers that differ by 30 are equal.
    cat >"class/s$number/run" <<END
# $((10#$number % 30))
sleep 0.05
awk -F'"' '/duration/ { end = \$2 } /integrator/ { dt = \$4 }
  /<particle/ { x = \$4; y = \$6; vx = \$8; vy = \$10 }
  END {
    print "step,time,x0,y0,vx0,vy0"
    for (i = 0; i <= int(end / dt + 0.5); ++i) {
      printf "%d,%.17g,%.17g,%.17g,%s,%s\n", i, i * dt, x, y, vx, vy
      $step; y += dt * vy
    }
  }' "\$1" >"\$2"
END
done
common=(class class --no-jacobians --no-progress)

echo "+ grade class class -o whole"
"$grade" "${common[@]}" -o whole --threads 1 >/dev/null

# The results are on a small disk, which another file fills for a while.
mkdir out
mount -t tmpfs -o size=8m none out || skip "a small file system cannot be mounted"
echo "+ grade class class -o out --on slurm --shards 20 --at-once 2"
"$grade" "${common[@]}" -o out --on slurm --shards 20 --at-once 2 >first.txt 2>first.log &
follower=$!
has_results() { [ "$(find out/resume -name '*.json' | wc -l)" -ge "$1" ]; }
tasks() { squeue --noheader --array --states="$1" --format='%i %o' | grep -v merge | awk '{ print $1 }'; }
is_running() { [ -n "$(tasks running)" ]; }
wait_for "the first results" has_results 4
wait_for "a running job" is_running
task=$(tasks running | head -n 1)
echo "+ scancel $task"
scancel "$task"
wait_for "another running job" is_running
task=$(tasks running | head -n 1)
echo "+ scontrol requeue $task"
scontrol requeue "$task" || echo "$task had ended"
echo "+ scontrol update node=$node state=drain; resume"
scontrol update nodename="$node" state=drain reason=test
is_drained() { sinfo --noheader --format=%T | grep -qx drained; }
wait_for "a drained node" is_drained
scontrol update nodename="$node" state=resume
wait_for "results after the drain" has_results 20
echo "+ fill the disk"
head -c 16M /dev/zero >out/ballast 2>/dev/null || true
has_failed() { grep -qs "storage full" out/slurm/*.txt || grep -qs "No space left" "$folder"/slurmd.log || ! is_running; }
wait_for "a job on the full disk" has_failed
sleep 1
rm out/ballast
echo "+ kill -INT the follower; grade class --attach"
kill -INT "$follower"
code=0
wait "$follower" || code=$?
[ "$code" = 130 ] || { echo "slurm: exit code $code instead of 130 of an interrupted follower"; cat first.log; exit 1; }
code=0
"$grade" "${common[@]}" -o out --attach >attached.txt 2>attached.log || code=$?
gaps=$(grep -c ',interrupted,' out/summary.csv || true)
echo "after a cancelled job, a requeue, a drain and a full disk: $gaps of 60 without a result, exit code $code"
if [ "$gaps" = 0 ] && [ "$code" != 0 ]; then cat attached.log; exit 1; fi
if [ "$gaps" != 0 ] && [ "$code" != 130 ]; then cat attached.log; exit 1; fi
echo "+ grade class class -o out --on slurm --resume"
"$grade" "${common[@]}" -o out --on slurm --shards 20 --resume >resumed.txt
diff -r whole/reports out/reports
diff whole/summary.csv out/summary.csv
diff whole/summary.txt out/summary.txt
diff whole/summary.txt resumed.txt
echo "+ grade class --cancel"
"$grade" "${common[@]}" -o out --on slurm --shards 20 >cancelled.txt 2>cancelled.log &
follower=$!
wait_for "a running job" is_running
"$grade" "${common[@]}" -o out --cancel
has_no_jobs() { [ -z "$(squeue --noheader)" ]; }
wait_for "the end of the jobs" has_no_jobs
kill -INT "$follower"
wait "$follower" || true
echo "slurm: passed: the table and the reports of 60 submissions are the same bytes"
