#!/usr/bin/env bash
# The part of setup/bare.sh that runs in the bare Debian:  bare_inside.sh FILE
# No `grep -q` in a pipe: it stops reading, and the program before it fails.
set -euo pipefail
trap 'echo "error: line $LINENO: $BASH_COMMAND" >&2' ERR
file=$1
programs=(bake bench detect encode info mix render)

say() { printf '\n== %s\n' "$*"; }
fail() { printf '\nerror: %s\n' "$*" >&2; exit 1; }
install_packages() { apt-get install -q -y -o Dpkg::Use-Pty=0 "$@" >/try/apt.log || { cat /try/apt.log; fail "apt"; }; }

# One job of every program in the folder $1, by a user without rights, in an empty folder.
run_programs() {
  local bin=$1
  rm -rf /try/jobs
  install -d -o nobody -g nogroup /try/jobs
  cat >/try/jobs.sh <<JOBS
set -euo pipefail
cd /try/jobs
export HOME=/try/jobs PATH=$bin:/usr/bin:/bin
for program in ${programs[*]}; do
  solidtex-\$program --version
  solidtex-\$program --help | grep '^Usage: ' >/dev/null
  solidtex-\$program --completion bash >\$program.bash
  bash -c "source \$program.bash; complete -p solidtex-\$program" | grep -- --version >/dev/null
done
solidtex-info granite-grey >info.txt
solidtex-bake granite-grey --size 64 -o box.npy -q && sha256sum box.npy
solidtex-bake granite-grey --size 16 -o box.vdb -q
solidtex-bake rock-veined --size 256,256,1 -o rock.png -q
solidtex-bake granite-beige --size 256,256,1 -o granite.png -q
solidtex-render /try/vase.ply --model wood-oak --size 240,180 --spp 4 -o vase.png -q
solidtex-encode rock.png --space stones -o rock.solidtex -q
solidtex-encode granite.png --space stones -o granite.solidtex -q
solidtex-mix rock.solidtex granite.solidtex -o mix.solidtex -q
solidtex-info mix.solidtex >mix.txt
solidtex-detect stones rock.png --patch 0,0,128,128 -o heat.png -q
solidtex-bench --quick -q 'sampler.*' >bench.txt
ls -l
JOBS
  # Bash without a terminal: nobody has no shell of its own.
  setpriv --reuid=nobody --regid=nogroup --clear-groups bash /try/jobs.sh
}

check_hardened() {  # of the files in $1
  local binary
  for binary in $(find "$1" -type f \( -path '*/bin/solidtex-*' -o -name 'libsolidtex.so*' \
                    -o -name 'solidtex.imageio.so' \)); do
    readelf -Wl "$binary" | grep GNU_RELRO >/dev/null || fail "$binary: no RELRO"
    readelf -Wl "$binary" | grep -E 'GNU_STACK.* RW ' >/dev/null || fail "$binary: the stack can be executed"
    readelf -Wd "$binary" | grep -E 'FLAGS_1.* NOW' >/dev/null || fail "$binary: RELRO without functions"
    readelf -Wh "$binary" | grep -E 'Type: +DYN' >/dev/null || fail "$binary: a fixed address"
    readelf -W --dyn-syms "$binary" | grep __stack_chk_fail >/dev/null || fail "$binary: unguarded stacks"
    readelf -W --dyn-syms "$binary" | grep _chk@ >/dev/null || fail "$binary: no _FORTIFY_SOURCE"
    echo "hardened: $binary"
  done
}

# The host of tests/install with the installation in $1, by CMake and by pkg-config.
link_host() {
  local prefix=$1 work
  work=$(mktemp -d)
  cp -r /try/host "$work/"
  cmake -S "$work/host" -B "$work/build" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
  cmake --build "$work/build" >/dev/null
  local pc
  pc=$(find "$prefix/lib" -name solidtex.pc)
  export PKG_CONFIG_PATH=${pc%/*}
  # shellcheck disable=SC2046  # several words on purpose
  cc -std=c99 "$work/host/host.c" -o "$work/host-pc" $(pkg-config --cflags --libs solidtex) \
    -Wl,-rpath,"$(pkg-config --variable=libdir solidtex)"
  "$work/build/host" granite-grey >"$work/one"
  "$work/host-pc" granite-grey | cmp - "$work/one"
  head -n 2 "$work/one"
}

try_deb() {
  say "apt install $file"
  df -m / | tail -n 1
  install_packages "$file"
  df -m / | tail -n 1
  dpkg-query -W -f '${Package} ${Version}: ${Installed-Size} KiB\n${Depends}\n${Recommends}\n' solidtex
  dpkg -L solidtex >/try/installed
  local program
  for program in "${programs[@]}"; do
    grep -qx "/usr/bin/solidtex-$program" /try/installed || fail "no solidtex-$program"
    grep -Eqx "/usr/share/man/man1/solidtex-$program.1(.gz)?" /try/installed || fail "no page of solidtex-$program"
  done
  grep -qx /usr/share/doc/solidtex/copyright /try/installed || fail "no copyright file"
  ! ldconfig -p | grep '/solidtex/' || fail "ldconfig knows a library that only solidtex is to load"
  say "programs of the .deb"
  run_programs /usr/bin
  say "manual pages, completion, hardening, a host"
  install_packages man-db bash-completion gcc libc6-dev make cmake pkg-config binutils
  for program in "${programs[@]}"; do
    man "solidtex-$program" | grep -- --version >/dev/null || fail "man solidtex-$program"
    bash -c 'source /usr/share/bash-completion/bash_completion
             _comp_load "$1" 2>/dev/null || _completion_loader "$1" || true
             complete -p "$1"' _ "solidtex-$program" | grep -- --version >/dev/null ||
      fail "bash does not complete solidtex-$program"
  done
  check_hardened /usr
  link_host /usr
  say "apt purge"
  apt-get purge -q -y solidtex | tail -n 3
  local path
  while read -r path; do
    case $path in *solidtex*) [ ! -e "$path" ] || fail "$path stays" ;; esac
  done </try/installed
  ! ldconfig -p | grep solidtex || fail "ldconfig knows the library"
  ! dpkg -l solidtex 2>/dev/null | grep '^[^un].*solidtex' || fail "dpkg knows the package"
  find / -xdev \( -path /try -o -path /proc -o -path /var/cache/man \) -prune -o -iname '*solidtex*' -print >/try/left
  [ ! -s /try/left ] || { cat /try/left; fail "files stay"; }
  echo "nothing stays"
}

try_tar() {
  say "unpack $file"
  local folder=/opt/somewhere/else
  rm -rf $folder && mkdir -p $folder
  tar -x -C $folder --strip-components=1 -f "$file"
  run_programs $folder/bin
  check_hardened $folder
  link_host $folder
}

try_wheel() {
  say "pip install $file"
  install_packages --no-install-recommends python3-venv
  python3 --version
  ! command -v cc || echo "(a compiler is here)"
  rm -rf /opt/wheel
  python3 -m venv /opt/wheel
  /opt/wheel/bin/pip install -q "$file"
  run_programs /opt/wheel/bin
  (cd / && /opt/wheel/bin/python -c '
import solidtex
texture = solidtex.Texture("marble")
print(len(solidtex.models()), "models", texture.eval_points([[0.5, 0.5, 0.5]]))')
}

say "$(. /etc/os-release; echo "$PRETTY_NAME"): $(basename "$file")"
apt-get update -q >/try/apt.log || { cat /try/apt.log; fail "apt-get update"; }
case $file in
  *.deb) try_deb ;;
  *.tar.gz) try_tar ;;
  *.whl) try_wheel ;;
  *) fail "$file: expected a .deb, a .tar.gz or a .whl" ;;
esac
say "$(basename "$file"): all of it works"
