# Steps that demo.sh and test.sh share. Sourced from the repository root.

say() { printf '\n== %s\n' "$*"; }

fail() { printf '\nerror: %s\n' "$*" >&2; exit 1; }

# Packages named in the given files (one a line, # comments) that dpkg does not report as installed.
missing_debian_packages() {
  local package
  sed -e 's/#.*//' "$@" | tr -s '[:space:]' '\n' | sed '/^$/d' | while read -r package; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] ||
      echo "$package"
  done
}

# Installs only what is missing, and asks for root only when something is.
install_debian_packages() {
  command -v dpkg-query >/dev/null || fail "this script sets up Debian 12 or 13; on other systems" \
    "install what the files in setup/ name, then: cmake -B build && cmake --build build"
  local missing
  mapfile -t missing < <(missing_debian_packages "$@")
  if [ "${#missing[@]}" -eq 0 ]; then
    echo "all installed"
    return
  fi
  echo "installing: ${missing[*]}"
  local root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "root is needed to install packages and sudo is not here;" \
      "as root: apt-get install ${missing[*]}"
    root=(sudo)
  fi
  "${root[@]}" apt-get update -q
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends "${missing[@]}"
}

# Half the machine's GiB bounds the parallel compilers: the CGAL and OpenVDB files need about 1.5 each.
build_jobs() {
  local cores gib
  cores=$(nproc)
  gib=$(awk '/MemTotal/ {print int($2 / 1048576 / 2)}' /proc/meminfo)
  [ "$gib" -ge 1 ] || gib=1
  echo $((cores < gib ? cores : gib))
}

build_solidtex() {  # arguments are passed on to CMake
  cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release "$@"
  cmake --build build --parallel "$(build_jobs)"
}

# The environment holds the Python package itself (editable) and what its tests need; the module
# solidtex it finds in build/, once that is built.
prepare_venv() {
  [ -x .venv/bin/python ] || python3 -m venv .venv
  local packages
  packages=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
  echo "$PWD/build/python" > "$packages/solidtex-build.pth"
  local stamp=.venv/installed-from
  if cmp -s python_export/pyproject.toml "$stamp"; then
    echo "up to date"
    return
  fi
  .venv/bin/pip install --quiet --editable 'python_export[test]'
  cp python_export/pyproject.toml "$stamp"
}
