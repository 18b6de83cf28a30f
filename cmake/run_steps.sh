# SPDX-License-Identifier: MIT
# Steps that tests/run, examples/run and fuzz/run share. Source it from the repository's root.

# What every build needs, by Debian's names.
build_packages=(g++ cmake ninja-build libeigen3-dev doctest-dev libcli11-dev nlohmann-json3-dev liblz4-dev
  libzstd-dev zlib1g-dev libusb-1.0-0-dev)
# What plays cameras to the tests.
camera_packages=(umockdev libumockdev-dev pkg-config)
fuzz_packages=(clang libclang-rt-14-dev)
cross_packages=(g++-aarch64-linux-gnu g++-arm-linux-gnueabihf g++-riscv64-linux-gnu gcc-arm-none-eabi
  libstdc++-arm-none-eabi-newlib libnewlib-arm-none-eabi qemu-user qemu-system-arm)

# install_missing PACKAGE...: installs those that are not there yet with apt-get, as root or by sudo.
install_missing() {
  if ! command -v apt-get >/dev/null; then
    echo "no apt-get here; these (Debian's names) have to be there: $*"
    return 0
  fi
  local package missing=() as_root=(env DEBIAN_FRONTEND=noninteractive)
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "root or sudo is needed to install: ${missing[*]}" >&2; return 1; }
    as_root=(sudo "${as_root[@]}")
  fi
  echo "== installing ${missing[*]}"
  local log
  log=$(mktemp)
  { "${as_root[@]}" apt-get update -qq && "${as_root[@]}" apt-get install -y -qq --no-install-recommends \
    -o DPkg::Lock::Timeout=400 "${missing[@]}"; } >"$log" 2>&1 </dev/null || { cat "$log" >&2; rm "$log"; return 1; }
  rm "$log"
}

# What makes a build from nothing take half as long: files of a target are compiled together, by the dozen. Compiled one by
# one, as in a user's build, they must come to the same: so is the firmware whose size is checked.
together=(-DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12)

# build_preset PRESET [TARGET...]: configures and builds; speaks only of what goes wrong, unless on a terminal.
build_preset() {
  local preset=$1 quiet=() targets=()
  shift
  [ $# -eq 0 ] || targets=(--target "$@")
  [ -t 1 ] || quiet=(-- --quiet)
  echo "== building preset $preset"
  cmake --preset "$preset" "${together[@]}" --log-level=WARNING >/dev/null
  cmake --build --preset "$preset" "${targets[@]}" "${quiet[@]}"
}
