# shellcheck shell=bash
# Sourced by examples/run.sh, tests/run.sh and .ci/ from the project's root: installs what is missing.

export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(getconf _NPROCESSORS_ONLN)}
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER=ccache; fi

libraries=(libeigen3-dev libnanoflann-dev libcli11-dev nlohmann-json3-dev libpugixml-dev catch2 libbenchmark-dev)
optional=(libembree-dev) # for the simulator; not every Debian has it

is_command() { command -v "$1" >/dev/null; }
is_package() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

# Prints the Debian packages that are missing, a tool only when its command is missing too: it may have come
# another way. `needs` holds pairs "command:package". Arguments as those of install_missing.
missing_packages() {
  local needs=(cmake:cmake ninja:ninja-build git:git c++:g++) need package
  if [ "${1:-}" = clang ]; then needs+=(g++:g++ clang++:clang); fi
  for need in "${needs[@]}"; do is_command "${need%%:*}" || echo "${need##*:}"; done
  if ! is_command apt-get; then return; fi # CMake finds or fetches the libraries
  if [ "${1:-}" = clang ]; then shift; fi
  for package in "${libraries[@]}" "${optional[@]}" "$@"; do is_package "$package" || echo "$package"; done
}

# install_missing [clang] [PACKAGE...]: what the build needs, the second compiler and further Debian packages if
# asked for. Stops with status 2 where it cannot.
install_missing() {
  local missing as_root=()
  mapfile -t missing < <(missing_packages "$@" | sort -u)
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  if ! is_command apt-get; then
    echo "Please install, under the names that your system has for them: ${missing[*]}" >&2
    echo "(CMake 3.22 or newer, a compiler for C++20. Libraries that CMake does not find, it fetches.)" >&2
    exit 2
  fi
  if [ "$(id -u)" -ne 0 ]; then
    if ! is_command sudo; then
      echo "Please run as root: apt-get install ${missing[*]}" >&2
      exit 2
    fi
    as_root=(sudo)
  fi
  echo "Installing: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  local package
  for package in "${optional[@]}"; do
    if apt-cache show "$package" >/dev/null 2>&1; then continue; fi
    echo "$package is not to be had here; what needs it is left out." >&2
    mapfile -t missing < <(printf '%s\n' "${missing[@]}" | grep -vx "$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# What the preset `release` is, in words that CMake before 3.25 knows.
configure_release() {
  cmake -S . -B build/release -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
}
