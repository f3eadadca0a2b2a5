#!/usr/bin/env bash
# Installs what was packed in an empty Debian 12, which never saw the sources, and runs a first
# example, timed. Needs root and debootstrap.
#   scripts/try_packages.sh debs ROOT FOLDER
# apt install of the Debian packages in FOLDER; then defrec render, track and demo.
#   scripts/try_packages.sh wheel ROOT FILE SEQUENCE
# pip install of the wheel FILE; then the guide's first example on SEQUENCE, a folder that defrec
# render made.
# ROOT is a folder, or is made: what debootstrap makes of its smallest variant. Packages come from
# where this machine's come.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/debian_sources.sh"
usage() {
    sed -n 's/^#   scripts/usage: scripts/p' "$0" >&2
    exit 2
}
what=${1:-} root=${2:-} packed=${3:-} sequence=${4:-}
case $what:$# in debs:3 | wheel:4) ;; *) usage ;; esac

if [ ! -e "$root/etc/debian_version" ]; then
    mirror="$(debian_mirror)"
    debootstrap --variant=minbase bookworm "$root" "$mirror" >/dev/null
    # As this machine reaches its packages: its sources of Debian's archive, its settings of apt,
    # its certificates.
    rm -f "$root/etc/apt/sources.list"
    cp /etc/apt/sources.list.d/debian.sources "$root/etc/apt/sources.list.d/"
    cp /etc/apt/apt.conf.d/* "$root/etc/apt/apt.conf.d/"
    mkdir -p "$root/etc/ssl/certs"
    cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
    cp -L /etc/resolv.conf "$root/etc/"
fi
rm -rf "$root/tried"
mkdir "$root/tried"

inside() { # COMMAND: by bash, in the root
    unshare --mount bash -c '
        mount -t proc proc "$0/proc" && mount -t sysfs sys "$0/sys" && exec chroot "$0" env -i \
            HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 TIMEFORMAT="%R s" \
            DEBIAN_FRONTEND=noninteractive bash -euo pipefail -c "$1"' "$root" "$1"
}
timed() { # TITLE COMMAND
    echo "== $1"
    inside "time { $2; }"
}

inside "apt-get -qq update"
if [ "$what" = debs ]; then
    cp "$packed"/*.deb "$root/tried"
    timed "apt-get install" \
        "apt-get -qq install --no-install-recommends -y /tried/*.deb >/tried/apt.log 2>&1"
    timed "defrec render" \
        "defrec render heartbeat --size 320x240 --frames 12 --quiet --out /tried/sequence"
    timed "defrec track" "cd /tried/sequence && defrec track --left left --right right \
        --calibration calibration.yaml --points points.csv --backend cpu --no-overlay --quiet \
        --out /tried/out && wc -l /tried/out/points.csv"
    timed "defrec demo" "cd /tried && defrec demo --no-open && ls defrec-demo/result/report.html"
    exit
fi
cp "$packed" "$root/tried"
cp -r "$sequence" "$root/tried/sequence"
cat >"$root/tried/example.py" <<'PYTHON'
import defrec

points = [(100, 100), (160.5, 120)]
for frame in defrec.track("left/", "right/", "calibration.yaml", points=points, device_id="cpu"):
    print(frame)
    print(frame.points.xyz, frame.points.expected_error_mm)
    assert frame.points.xyz.shape == (2, 3)
PYTHON
inside "apt-get -qq install --no-install-recommends -y \
    python3 python3-venv python3-numpy python3-pil >/tried/apt.log 2>&1"
inside "python3 -m venv --system-site-packages /tried/python"
timed "pip install" "/tried/python/bin/pip install --quiet --no-index /tried/*.whl"
timed "the first example" "cd /tried/sequence && /tried/python/bin/python3 /tried/example.py"
