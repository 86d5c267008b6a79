# The tiny experiment in an allocation of a private Slurm on this machine gives
# the same bytes as a run without it.  Needs root and `make deps-slurm`.
PATH=$PATH:/usr/sbin
missing=
for p in munged slurmctld slurmd srun salloc; do command -v $p >/dev/null || missing="$missing $p"; done
if [ -n "$missing" ] || [ "$(id -u)" -ne 0 ]; then
    skip "Slurm not tested: ${missing:+missing$missing, make deps-slurm installs them}${missing:-not root}"
    return 0 2>/dev/null || exit 0
fi

# one controller, one node, both this host, reached over loopback; own keys, ports and spool
site=$(mktemp -d /tmp/slurm.XXXXXX)
chmod 755 "$site"
mkdir "$site/state" "$site/spool"
host=$(hostname -s)
daemons="slurmd slurmctld munged"
down() {
    for p in $daemons; do [ -s "$site/$p.pid" ] && kill "$(cat "$site/$p.pid")" 2>/dev/null; done
    sleep 1
    rm -rf "$site"
}
trap down EXIT
( umask 077; head -c 1024 /dev/urandom >"$site/key" )
export SLURM_CONF=$site/slurm.conf
setting() { printf '%s=%s\n' "$@"; }
{   setting ClusterName pixshear SlurmctldHost "$host(127.0.0.1)" SlurmUser root SlurmdUser root \
        SlurmctldPort 26817 SlurmdPort 26818 AuthType auth/munge AuthInfo "socket=$site/socket" CredType cred/munge \
        StateSaveLocation "$site/state" SlurmdSpoolDir "$site/spool" \
        SlurmctldPidFile "$site/slurmctld.pid" SlurmdPidFile "$site/slurmd.pid" \
        SlurmctldLogFile "$site/slurmctld.log" SlurmdLogFile "$site/slurmd.log" \
        ProctrackType proctrack/linuxproc TaskPlugin task/none MpiDefault none \
        SelectType select/cons_tres SelectTypeParameters CR_CPU ReturnToService 2 MailProg /bin/true
    echo "NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN"
    echo "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP"
} >"$SLURM_CONF"
ready() {
    munged --force --key-file="$site/key" --socket="$site/socket" --pid-file="$site/munged.pid" \
        --log-file="$site/munged.log" --seed-file="$site/seed" && slurmctld -c && slurmd || return 1
    for _ in $(seq 40); do sinfo -h -o %t 2>/dev/null | grep -q idle && return 0; sleep .5; done
    return 1
}
if [ "$(nproc)" -lt 2 ] || ! ready >start.log 2>&1; then
    skip "Slurm not tested: it does not start here: $(tail -qn1 "$site"/*.log start.log 2>/dev/null | tail -1 | cut -c1-150)"
    return 0 2>/dev/null || exit 0
fi

mkdir -p here/examples
cp -r "$TOP/examples/pixelscale" here/examples/
ln -s "$BIN" here/bin
cd here/examples/pixelscale || exit 1
rm -rf quick* paper* tiny*
tiny="FIGURES= PICTURES= tiny.fields=sim1d-0.20 tiny.shears=0"
sums() { (cd tiny && find . -maxdepth 1 -type f ! -name '.*' | sort | xargs sha256sum); }
make -s -j2 tiny $tiny >log 2>&1 || fail "local run: $(tail -2 log)"
sums >local
rm -rf tiny
timeout 120 salloc -Q -n2 make -s -j2 tiny $tiny LAUNCH="srun -n1 --exact -Q" >log 2>&1 || fail "run under Slurm: $(tail -2 log)"
sums >slurm
between "files compared" "$(wc -l <local)" 10 40
same "salloc -n2 make -j2 LAUNCH='srun -n1 --exact -Q': the same bytes as without" local slurm
ok "the steps did run under Slurm" test "$(grep -c 'launch task' "$site/slurmd.log")" -ge 10
