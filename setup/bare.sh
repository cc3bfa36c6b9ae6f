#!/usr/bin/env bash
# Tries packages in a Debian that has nothing else: installs them, runs every program, links a host,
# removes them, and looks for what stays.
#   setup/bare.sh SUITE FOLDER [FILE...]    SUITE: bookworm, trixie ...; FILE: .deb, .tar.gz or .whl
# FOLDER becomes that Debian, made by debootstrap (root, 0.3 to 2 GB), and is kept; nothing else on
# this machine changes. A .tar.gz needs libraries of the system, so name it after the .deb.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,6s/^# //p' "$0"; exit 2; }
suite=$1 root=$(realpath -m "$2")
shift 2
here=$(realpath "$(dirname "${BASH_SOURCE[0]}")/..")

if [ ! -e "$root/ready" ]; then
  how=("$suite" "$root")  # an older debootstrap knows no newer suite, which it would make as sid
  [ -e "/usr/share/debootstrap/scripts/$suite" ] || how+=(http://deb.debian.org/debian sid)
  debootstrap --variant=minbase "${how[@]}"
  touch "$root/ready"
fi
# How this machine reaches the network: names, proxies, certificates.
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
apt-config dump | grep -E '^Acquire::(https?|Check-)' >"$root/etc/apt/apt.conf.d/00machine" || true
mkdir -p "$root/usr/local/share" "$root/etc/ssl/certs" "$root/try"
cp -r /usr/local/share/ca-certificates "$root/usr/local/share/" 2>/dev/null || true
[ ! -e /etc/ssl/certs/ca-certificates.crt ] ||
  cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
settings=(HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive)
while read -r setting; do
  settings+=("$setting")
done < <(env | grep -iE '^(PIP_CERT=|PIP_INDEX_URL=|SSL_CERT_FILE=|[a-z]+_proxy=)')

cp -r "$here/setup/bare_inside.sh" "$here/tests/install/host" "$here/scenes/meshes/vase.ply" \
  "$root/try/"
mount -t proc proc "$root/proc"
trap 'umount "$root/proc"' EXIT
for file in "$@"; do
  cp "$file" "$root/try/"
  env -i "${settings[@]}" chroot "$root" bash /try/bare_inside.sh "/try/$(basename "$file")"
done
