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

# ONNX Runtime runs the encoders of texture spaces. Debian 13 has it. On Debian 12 the headers of
# Debian 13's package, unpacked and not installed, and the library of the PyPI wheel go to
# build/onnxruntime: its interface only grows, so headers may be older than the library. Everything
# else works without it, so a failure is a warning.
prepare_onnxruntime() {
  local target=build/onnxruntime
  mkdir -p build
  if [ -n "$(apt-cache policy libonnxruntime-dev | sed -n 's/.*Candidate: \([0-9].*\)/\1/p')" ]; then
    echo libonnxruntime-dev > build/onnxruntime.txt
    install_debian_packages build/onnxruntime.txt
  elif [ -e $target/include/onnxruntime_cxx_api.h ] && compgen -G "$target/lib/*.so*" >/dev/null; then
    echo "up to date"
  else
    rm -rf $target
    mkdir -p $target/lists/partial $target/include $target/lib
    onnxruntime_headers $target && onnxruntime_library $target ||
      echo "warning: no ONNX Runtime: solidtex-encode will say what it lacks, all else works"
    rm -rf $target/lists $target/package $target/wheel $target/sources.list $target/*.deb
  fi
}

onnxruntime_headers() {  # of Debian 13, into $1/include
  local mirror keys=/usr/share/keyrings/debian-archive-keyring.gpg
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Codename: bookworm' 'Origin: Debian' |
             head -n 1)
  echo "deb [signed-by=$keys] ${mirror:-http://deb.debian.org/debian} trixie main" \
    > "$1/sources.list"
  local apt=(apt-get -q -o "Dir::State::Lists=$PWD/$1/lists" -o "Dir::Cache=$PWD/$1/lists"
             -o "Dir::Etc::SourceList=$PWD/$1/sources.list" -o Dir::Etc::SourceParts=/dev/null
             -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false
             -o Acquire::Languages=none -o APT::Sandbox::User=root)
  "${apt[@]}" update && (cd "$1" && "${apt[@]}" download libonnxruntime-dev) &&
    dpkg -x "$1"/libonnxruntime-dev_*.deb "$1/package" &&
    cp "$1"/package/usr/include/onnxruntime/*.h "$1/include"
}

onnxruntime_library() {  # of the PyPI wheel, into $1/lib
  python3 -m venv --clear "$1/wheel" &&
    "$1/wheel/bin/pip" download --quiet --no-deps --dest "$1/wheel" onnxruntime &&
    python3 -m zipfile -e "$1"/wheel/onnxruntime-*.whl "$1/wheel" &&
    cp "$1"/wheel/onnxruntime/capi/libonnxruntime.so* "$1/lib"
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
